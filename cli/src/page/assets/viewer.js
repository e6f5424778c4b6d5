// Surfaces that turn with the mouse.
const VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in vec3 hue; uniform mat3 turn; uniform vec2 size; out vec3 across; out vec3 tone;
void main() {
  vec3 p = turn * place;
  across = turn * normal;
  tone = hue;
  gl_Position = vec4(p.xy * size, -0.3 * p.z, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 across; in vec3 tone; out vec4 colour; uniform float cover;
void main() {
  vec3 n = across / max(length(across), 1e-9);
  if (!gl_FrontFacing) n = -n;
  // One light from above on the left, and one at the eye.
  float light = 0.3 + 0.5 * max(dot(n, normalize(vec3(-0.4, 0.5, 0.8))), 0.0) + 0.25 * n.z;
  colour = vec4(tone * light * cover, cover);
}`;
const PLAIN = [0.45, 0.68, 0.92];
const OVER = [1.0, 0.62, 0.25];
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
const offsetsOf = part => Float32Array.from(new Int16Array(bytesOf(part.offsets).buffer), x => x * part.unit / 32767.5);
// A surface on the graphics card, with a colour at every point or one for all.
const surfaceOf = (gl, shader) => {
  const own = gl.createVertexArray();
  gl.bindVertexArray(own);
  const attributes = ['place', 'normal', 'hue'].map(name => {
    const at = gl.getAttribLocation(shader, name);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
    if (name !== 'hue') gl.enableVertexAttribArray(at);
    return {at, buffer};
  });
  const list = gl.createBuffer();
  let [count, kind, plain] = [0, gl.UNSIGNED_SHORT, true];
  return {
    load: (places, corners, hues) => {
      gl.bindVertexArray(own);
      [places, normalsOf(places, corners), hues].forEach((values, k) => {
        if (!values) return;
        gl.bindBuffer(gl.ARRAY_BUFFER, attributes[k].buffer);
        gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
      });
      plain = !hues;
      if (plain) gl.disableVertexAttribArray(attributes[2].at);
      else gl.enableVertexAttribArray(attributes[2].at);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, list);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
      [count, kind] = [corners.length, corners.BYTES_PER_ELEMENT === 4 ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT];
    },
    draw: hue => {
      gl.bindVertexArray(own);
      if (plain) gl.vertexAttrib3f(attributes[2].at, ...hue);
      gl.drawElements(gl.TRIANGLES, count, kind, 0);
    },
  };
};
const choice = (controls, name, words, chosen, then) => {
  const label = made('label', {}, name);
  const input = made('select', {});
  words.forEach((text, k) => input.append(made('option', {value: k}, text)));
  input.value = chosen;
  input.addEventListener('change', () => then(Number(input.value)));
  label.append(input);
  controls.append(label);
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
  const solid = part => ({name: part.name, places: placesOf(part.points), corners: cornersOf(part)});
  const frames = scene.frames.map(solid);
  const modes = scene.modes.map(mode => ({name: mode.name, offsets: offsetsOf(mode), score: 0}));
  const overlays = scene.overlays.map(part => Object.assign(solid(part), {offsets: offsetsOf(part)}));
  const bars = scene.bars.map(bar => {
    const colours = bar.colours.map(text => [1, 3, 5].map(at => parseInt(text.slice(at, at + 2), 16) / 255));
    const hues = Float32Array.from([...bytesOf(bar.shares)].flatMap(level => colours[level]));
    return Object.assign({hues}, bar);
  });
  let [shown, over, carried, bar] = [0, overlays.length ? 0 : -1, 0, bars.length ? 0 : -1];
  // Of the ball around the middle that has all points.
  let radius = 1e-3;
  for (const {places} of [...frames, ...overlays]) {
    for (let i = 0; i < places.length; i += 3) radius = Math.max(radius, Math.hypot(places[i], places[i + 1], places[i + 2]));
  }
  const start = {azimuth: scene.azimuth, elevation: scene.elevation, zoom: 1};
  const view = Object.assign({}, start);
  gl.useProgram(shader);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.polygonOffset(1, 1);
  const [base, laid] = [surfaceOf(gl, shader), surfaceOf(gl, shader)];
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
    gl.uniform1f(uniform('cover'), 1);
    if (over < 0) {
      base.draw(PLAIN);
      return;
    }
    laid.draw(OVER);
    // What is nearest of the average, and then only that, as a veil over the input.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.colorMask(false, false, false, false);
    base.draw(PLAIN);
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND);
    gl.uniform1f(uniform('cover'), 0.6);
    base.draw(PLAIN);
    gl.disable(gl.BLEND);
    gl.disable(gl.POLYGON_OFFSET_FILL);
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
    base.load(places, corners, bar < 0 ? null : bars[bar].hues);
    if (over >= 0) {
      const part = overlays[over];
      laid.load(part.places.map((x, i) => x + carried * part.offsets[i]), part.corners, null);
    }
    ask();
  };
  if (bars.length) {
    choice(controls, 'colours', bars.map(bar => bar.name), 0, k => {
      bar = k;
      legend(figure, bars[bar], controls);
      load();
    });
    legend(figure, bars[0], controls);
  }
  if (overlays.length) {
    choice(controls, 'input', ['none', ...overlays.map(part => part.name)], 1, k => {
      over = k - 1;
      load();
    });
    slider(controls, 'carried', [0, 1, 0.05, 0], share => Math.round(100 * share) + ' %', share => {
      carried = share;
      load();
    });
  }
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
