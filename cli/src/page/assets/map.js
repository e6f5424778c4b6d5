// Distances: what the points of the map and the cells of the matrix are.
for (const figure of document.querySelectorAll('figure.map')) {
  const {names, groups, rows, columns, first, matrix, heat, marks} = dataOf('distances');
  const canvas = figure.querySelector('canvas');
  const circles = [...figure.querySelectorAll('circle')];
  const tip = made('div', {class: 'tip', hidden: ''});
  document.body.append(tip);
  const told = i => names[i] + (groups[i] ? ' (' + groups[i] + ')' : '');
  const show = (event, shapes, text) => {
    tip.replaceChildren(...shapes.filter(i => marks[i]).map(i => made('img', {src: marks[i], alt: ''})), made('div', {}, text));
    tip.hidden = false;
    tip.style.left = Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 4) + 'px';
    tip.style.top = Math.min(event.clientY + 14, innerHeight - tip.offsetHeight - 4) + 'px';
    circles.forEach((circle, i) => circle.classList.toggle('hot', shapes.includes(i)));
  };
  const hide = () => {
    tip.hidden = true;
    circles.forEach(circle => circle.classList.remove('hot'));
  };
  circles.forEach((circle, i) => {
    circle.addEventListener('pointermove', event => show(event, [i], told(i)));
    circle.addEventListener('pointerleave', hide);
  });
  const cell = Math.max(2, Math.min(40, Math.floor(480 / Math.max(rows.length, columns.length))));
  canvas.width = columns.length * cell;
  canvas.height = rows.length * cell;
  const most = Math.max(...matrix.flat().map(Number)) || 1;
  const paint = canvas.getContext('2d');
  const shade = share => {
    const place = share * (heat.length - 1);
    const k = Math.min(Math.floor(place), heat.length - 2);
    const mixed = heat[k].map((from, c) => Math.round(from + (heat[k + 1][c] - from) * (place - k)));
    return 'rgb(' + mixed.join(',') + ')';
  };
  const shares = [...Array(101).keys()].map(k => k / 100);
  legend(figure, {
    name: 'distance',
    colours: ['', ...shares.map(shade)],
    marks: [0, .5, 1].map(share => [share, String(Number((share * most).toPrecision(3)))]),
  }, canvas);
  rows.forEach((i, row) => columns.forEach((j, column) => {
    const value = matrix[i][j - first];
    if (value === null) return;
    paint.fillStyle = shade(value / most);
    paint.fillRect(column * cell, row * cell, cell, cell);
  }));
  canvas.addEventListener('pointermove', event => {
    const box = canvas.getBoundingClientRect();
    const at = [event.clientY - box.top, event.clientX - box.left].map(p => Math.floor(p * columns.length / box.width));
    const [i, j] = [rows[at[0]], columns[at[1]]];
    if (i === undefined || j === undefined) return hide();
    const value = matrix[i][j - first];
    show(event, i === j ? [i] : [i, j],
      i === j ? told(i) : told(i) + '\n' + told(j) + '\n' + (value === null ? 'no distance' : 'distance ' + value));
  });
  canvas.addEventListener('pointerleave', hide);
}
