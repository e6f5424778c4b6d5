// Animations: the browser plays them; a slider shows single frames, taken out of the file.
const crcTable = Uint32Array.from({length: 256}, (_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n >>> 0;
});
const crcOf = bytes => {
  let sum = 0xffffffff;
  for (const byte of bytes) sum = crcTable[(sum ^ byte) & 255] ^ (sum >>> 8);
  return (sum ^ 0xffffffff) >>> 0;
};
const chunk = (kind, parts) => {
  const length = parts.reduce((sum, part) => sum + part.length, 0);
  const bytes = new Uint8Array(length + 12);
  const view = new DataView(bytes.buffer);
  view.setUint32(0, length);
  for (let k = 0; k < 4; k++) bytes[4 + k] = kind.charCodeAt(k);
  let at = 8;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  view.setUint32(at, crcOf(bytes.subarray(4, at)));
  return bytes;
};
// The frames of an APNG file whose frames are all of its size, as addresses of PNG files.
const framesOf = url => {
  const file = bytesOf(url.slice(url.indexOf(',') + 1));
  const view = new DataView(file.buffer);
  const frames = [];
  let header = null;
  for (let at = 8; at + 12 <= file.length;) {
    const length = view.getUint32(at);
    const kind = String.fromCharCode(...file.subarray(at + 4, at + 8));
    const content = file.subarray(at + 8, at + 8 + length);
    if (kind === 'IHDR') header = content;
    if (kind === 'fcTL') frames.push([]);
    if (kind === 'IDAT' && frames.length) frames[frames.length - 1].push(content);
    if (kind === 'fdAT') frames[frames.length - 1].push(content.subarray(4));
    at += length + 12;
  }
  return frames.map(parts => URL.createObjectURL(new Blob(
    [file.subarray(0, 8), chunk('IHDR', [header]), chunk('IDAT', parts), chunk('IEND', [])],
    {type: 'image/png'})));
};
for (const figure of document.querySelectorAll('figure.player')) {
  const image = figure.querySelector('img');
  const controls = figure.querySelector('.controls');
  const [button, input, output] = controls.children;
  const whole = image.src;
  const [low, high] = [Number(figure.dataset.low), Number(figure.dataset.high)];
  const frames = framesOf(whole);
  // They run forth and back.
  const last = Math.floor(frames.length / 2);
  if (last === 0) continue;
  input.max = last;
  controls.hidden = false;
  const still = () => {
    const k = Number(input.value);
    image.src = frames[k];
    output.textContent = figure.dataset.word + ' ' + (low + (high - low) * k / last).toFixed(2);
    button.textContent = 'play';
  };
  input.addEventListener('input', still);
  button.addEventListener('click', () => {
    if (image.src !== whole) {
      image.src = whole;
      output.textContent = '';
      button.textContent = 'pause';
    } else still();
  });
  if (matchMedia('(prefers-reduced-motion: reduce)').matches) still();
}
