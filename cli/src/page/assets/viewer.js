// Surfaces that turn with the mouse.
const VERTEX = `#version 300 es
in vec3 place; in vec3 normal; uniform mat3 turn; uniform vec2 size; out vec3 across;
void main() {
  vec3 p = turn * place;
  across = turn * normal;
  gl_Position = vec4(p.xy * size, -0.3 * p.z, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 across; out vec4 colour; uniform vec3 hue;
void main() {
  vec3 n = across / max(length(across), 1e-9);
  if (!gl_FrontFacing) n = -n;
  // One light from above on the left, and one at the eye.
  float light = 0.3 + 0.5 * max(dot(n, normalize(vec3(-0.4, 0.5, 0.8))), 0.0) + 0.25 * n.z;
  colour = vec4(hue * light, 1.0);
}`;
const program = gl => {
  const all = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const part = gl.createShader(kind);
    gl.shaderSource(part, text);
    gl.compileShader(part);
    gl.attachShader(all, part);
  }
  gl.linkProgram(all);
  return gl.getProgramParameter(all, gl.LINK_STATUS) ? all : null;
};
// Normals at the points, from the triangles around them.
const normalsOf = (places, corners) => {
  const normals = new Float32Array(places.length);
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = [3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]];
    const [ux, uy, uz] = [places[b] - places[a], places[b + 1] - places[a + 1], places[b + 2] - places[a + 2]];
    const [vx, vy, vz] = [places[c] - places[a], places[c + 1] - places[a + 1], places[c + 2] - places[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) {
      normals[corner] += x;
      normals[corner + 1] += y;
      normals[corner + 2] += z;
    }
  }
  return normals;
};
// Coordinates between -1 and 1.
const placesOf = letters => {
  const numbers = new Uint16Array(bytesOf(letters).buffer);
  return Float32Array.from(numbers, x => x / 32767.5 - 1);
};
const cornersOf = frame => {
  const buffer = bytesOf(frame.corners).buffer;
  return frame.wide ? new Uint32Array(buffer) : new Uint16Array(buffer);
};
const viewer = figure => {
  const scene = dataOf(figure.dataset.of);
  const canvas = figure.querySelector('canvas');
  const controls = figure.querySelector('.controls');
  const gl = canvas.getContext('webgl2', {antialias: true});
  const shader = gl && program(gl);
  if (!shader) {
    canvas.replaceWith(made('p', {}, 'This browser does not draw surfaces; the pictures show them.'));
    return;
  }
  const frames = scene.frames.map(frame => ({name: frame.name, places: placesOf(frame.points), corners: cornersOf(frame)}));
  const modes = scene.modes.map(mode => ({
    name: mode.name,
    offsets: Float32Array.from(new Int16Array(bytesOf(mode.offsets).buffer), x => x * mode.unit / 32767.5),
    score: 0,
  }));
  let shown = 0;
  // Of the ball around the middle that has all points.
  let radius = 1e-3;
  for (const {places} of frames) {
    for (let i = 0; i < places.length; i += 3) radius = Math.max(radius, Math.hypot(places[i], places[i + 1], places[i + 2]));
  }
  const start = {azimuth: -60, elevation: 25, zoom: 1};
  const view = Object.assign({}, start);
  gl.useProgram(shader);
  gl.enable(gl.DEPTH_TEST);
  const buffers = ['place', 'normal'].map(name => {
    const at = gl.getAttribLocation(shader, name);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
    return buffer;
  });
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  const uniform = name => gl.getUniformLocation(shader, name);
  let asked = false;
  const draw = () => {
    asked = false;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map(n => Math.max(1, Math.round(n * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [a, e] = [view.azimuth, view.elevation].map(angle => angle * Math.PI / 180);
    const [sa, ca, se, ce] = [Math.sin(a), Math.cos(a), Math.sin(e), Math.cos(e)];
    gl.uniformMatrix3fv(uniform('turn'), false, [-sa, -se * ca, ce * ca, ca, -se * sa, ce * sa, 0, ce, se]);
    const size = 0.95 / radius * view.zoom * Math.min(width, height);
    gl.uniform2f(uniform('size'), size / width, size / height);
    gl.uniform3f(uniform('hue'), 0.45, 0.68, 0.92);
    const corners = frames[shown].corners;
    gl.drawElements(gl.TRIANGLES, corners.length, corners.BYTES_PER_ELEMENT === 4 ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT, 0);
  };
  const ask = () => {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  };
  const load = () => {
    const {places: still, corners} = frames[shown];
    const places = Float32Array.from(still);
    for (const {offsets, score} of modes) {
      if (score !== 0) for (let i = 0; i < places.length; i++) places[i] += score * offsets[i];
    }
    [places, normalsOf(places, corners)].forEach((values, k) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[k]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    });
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
    ask();
  };
  if (frames.length > 1) {
    const last = frames.length - 1;
    const input = slider(controls, '', [0, last, 1, 0], k => frames[k].name, k => {
      shown = k;
      load();
    });
    const button = made('button', {type: 'button'}, 'play');
    let timer = 0;
    let step = 1;
    button.addEventListener('click', () => {
      if (timer) {
        clearInterval(timer);
        timer = 0;
      } else {
        timer = setInterval(() => {
          const k = Number(input.value);
          if (k === last) step = -1;
          if (k === 0) step = 1;
          input.value = k + step;
          input.dispatchEvent(new Event('input'));
        }, 250);
      }
      button.textContent = timer ? 'pause' : 'play';
    });
    controls.prepend(button);
  }
  for (const mode of modes) {
    const most = scene.amplitude;
    slider(controls, mode.name, [-most, most, most / 20, 0], score => score.toFixed(1) + ' s.d.', score => {
      mode.score = score;
      load();
    });
  }
  const turn = (right, up) => {
    view.azimuth -= right;
    view.elevation = Math.max(-90, Math.min(90, view.elevation + up));
    ask();
  };
  const zoom = factor => {
    view.zoom = Math.max(0.2, Math.min(20, view.zoom * factor));
    ask();
  };
  let held = null;
  canvas.addEventListener('pointerdown', event => {
    held = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', event => {
    if (!held) return;
    turn(0.5 * (event.clientX - held[0]), 0.5 * (event.clientY - held[1]));
    held = [event.clientX, event.clientY];
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { held = null; });
  // Not before a click, so that the wheel moves the page.
  canvas.addEventListener('wheel', event => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(-0.001 * event.deltaY));
  }, {passive: false});
  canvas.addEventListener('dblclick', () => {
    Object.assign(view, start);
    ask();
  });
  canvas.addEventListener('keydown', event => {
    const keys = {
      ArrowLeft: () => turn(-5, 0), ArrowRight: () => turn(5, 0), ArrowUp: () => turn(0, -5),
      ArrowDown: () => turn(0, 5), '+': () => zoom(1.1), '-': () => zoom(1 / 1.1),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  new ResizeObserver(ask).observe(canvas);
  load();
};
document.querySelectorAll('figure.viewer').forEach(viewer);
