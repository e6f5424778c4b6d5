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
