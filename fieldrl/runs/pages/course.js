// Draws the best episode: the field of a moment, the path up to its sample, what the sample said.
const course = JSON.parse(document.getElementById("course").textContent);
const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
const fields = bytes(course.fields), palette = bytes(course.palette);
const canvas = document.getElementById("field"), pen = canvas.getContext("2d");
const slider = document.getElementById("moment"), play = document.getElementById("play");
const told = document.getElementById("told");
const size = [course.upper[0] - course.lower[0], course.upper[1] - course.lower[1]];
const cells = course.width * course.height, short = value => value === null ? "–" : value.toPrecision(4);
let timer = null;

function image(moment) {
  const drawn = document.createElement("canvas");
  drawn.width = course.width; drawn.height = course.height;
  const pixels = new ImageData(course.width, course.height);
  for (let i = 0; i < cells; i++) {
    const shade = 3 * fields[moment * cells + i];
    for (let c = 0; c < 3; c++) pixels.data[4 * i + c] = palette[shade + c];
    pixels.data[4 * i + 3] = 255;
  }
  drawn.getContext("2d").putImageData(pixels, 0, 0);
  return drawn;
}

function draw() {
  const moment = Number(slider.value), step = course.steps[moment];
  const width = canvas.clientWidth * devicePixelRatio, scale = width / size[0];
  canvas.width = width; canvas.height = scale * size[1];
  const at = ([x, y]) => [(x - course.lower[0]) * scale, canvas.height - (y - course.lower[1]) * scale];
  pen.drawImage(image(moment), 0, 0, canvas.width, canvas.height);
  pen.fillStyle = "#d9d9d9";
  for (const one of course.obstacles) {
    pen.beginPath();
    if (one.kind === "circle") pen.arc(...at(one.centre), one.radius * scale, 0, 7);
    else pen.rect(...at([one.lower[0], one.upper[1]]), (one.upper[0] - one.lower[0]) * scale, (one.upper[1] - one.lower[1]) * scale);
    pen.fill();
  }
  const unit = 1.5 * devicePixelRatio, path = [course.start, ...course.path.slice(0, step + 1)].map(at);
  for (const [colour, thick] of [["#fff", 3.2], ["#222", 1.4]]) {
    pen.strokeStyle = colour; pen.lineWidth = thick * unit; pen.beginPath();
    path.forEach(point => pen.lineTo(...point)); pen.stroke();
  }
  path.forEach((point, i) => {
    pen.beginPath(); pen.arc(...point, (i ? 2.5 : 3.5) * unit, 0, 7);
    pen.fillStyle = i ? "#222" : "#d55e00"; pen.fill();
    pen.strokeStyle = "#fff"; pen.lineWidth = 0.8 * unit; pen.stroke();
  });
  pen.strokeStyle = "#d55e00"; pen.lineWidth = 1.6 * unit;
  pen.beginPath(); pen.arc(...path.at(-1), 6 * unit, 0, 7); pen.stroke();
  const believed = course.names.map((name, i) => `${name} = ${short(course.theta[step][i])}`).join(", ");
  told.textContent = `Sample ${step + 1} of ${course.path.length}, time ${short(course.time[step])}: measured ` +
    `${short(course.value[step])}. Estimate so far: ${believed}; e_total = ${short(course.e_total[step])}.`;
}

function stop() { clearInterval(timer); timer = null; play.textContent = "Play"; }
function start() {
  if (Number(slider.value) === course.steps.length - 1) slider.value = 0;
  play.textContent = "Pause"; draw();
  timer = setInterval(() => {
    if (Number(slider.value) === course.steps.length - 1) return stop();
    slider.value = Number(slider.value) + 1; draw();
  }, 700);
}
play.onclick = () => timer ? stop() : start();
slider.oninput = () => { stop(); draw(); };
addEventListener("resize", draw);
slider.max = course.steps.length - 1;
slider.value = slider.max;
draw();
