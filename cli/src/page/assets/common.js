// What all scripts of the page share.
const bytesOf = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
const dataOf = id => JSON.parse(document.getElementById(id).textContent);
const made = (name, attributes, text) => {
  const element = document.createElement(name);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  if (text !== undefined) element.textContent = text;
  return element;
};
// A slider with its name and its value in words.
const slider = (controls, name, [low, high, step, value], words, moved) => {
  const label = made('label', {}, name);
  const input = made('input', {type: 'range', min: low, max: high, step: step, value: value});
  const output = made('output', {}, words(value));
  input.addEventListener('input', () => {
    output.textContent = words(Number(input.value));
    moved(Number(input.value));
  });
  label.append(input, output);
  controls.append(label);
  return input;
};
// The colours of a bar, and under it what they mean, below another element.
const legend = (figure, bar, above) => {
  const old = figure.querySelector('.legend');
  if (old) old.remove();
  if (!bar) return;
  const box = made('div', {class: 'legend'});
  box.append(made('div', {}, bar.name));
  const strip = made('canvas', {width: bar.colours.length - 1, height: 1});
  const brush = strip.getContext('2d');
  bar.colours.slice(1).forEach((colour, k) => {
    brush.fillStyle = colour;
    brush.fillRect(k, 0, 1, 1);
  });
  const marks = made('div', {class: 'marks'});
  for (const [share, text] of bar.marks) {
    const mark = made('span', {}, text);
    mark.style.left = 100 * share + '%';
    // The first and the last one do not stand out over the ends.
    mark.style.transform = 'translateX(-' + 100 * share + '%)';
    marks.append(mark);
  }
  box.append(strip, marks);
  above.after(box);
};
