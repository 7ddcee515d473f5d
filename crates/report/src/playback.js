
// a disc for a keypoint that is visible, a ring for one that is hidden, a cross for another side's or person's
const markKeypoint = (pen, [x, y, kind], size) => {
  pen.beginPath();
  if (kind === 2) {
    for (const side of [-1, 1]) {
      pen.moveTo(x - size, y - side * size);
      pen.lineTo(x + size, y + side * size);
    }
  } else pen.arc(x, y, size, 0, 7);
  for (const [width, ink] of [[1, "#101820"], [0.5, kind === 2 ? "#ff4fa3" : "#ffd23f"]]) {
    pen.lineWidth = width * size;
    pen.strokeStyle = ink;
    pen.stroke();
  }
  if (kind === 0) {
    pen.fillStyle = "#ffd23f";
    pen.fill();
  }
};

const playback = () => {
  const source = document.getElementById("playback-data");
  if (!source) return;
  const keypoints = JSON.parse(document.getElementById("keypoints-data")?.textContent || "null");
  const seeds = [JSON.parse(source.textContent)].flat();
  let data = seeds[0];
  const section = document.getElementById("playback");
  const transport = document.querySelector(".transport");
  const part = (name) => document.querySelector(`[data-is="${name}"]`);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  let views;
  let points;
  let viewStarts;
  let middles;
  const cameras = data.cameras.length;
  let kept = data.error.length;
  const MARKERS = 15;
  const NOWHERE = -32768;

  // where every view begins: 12 bytes of box and length, then its runs
  const starts = (packed) => {
    const found = [];
    const numbers = new DataView(packed.buffer);
    for (let at = 0; at < packed.length; at += 12 + numbers.getUint32(at + 8, true)) found.push(at);
    return found;
  };
  const boxAt = (packed, at) => {
    const numbers = new DataView(packed.buffer, at);
    return [0, 2, 4, 6, 8].map((offset, index) => (index < 4 ? numbers.getUint16(offset, true) : numbers.getUint32(offset, true)));
  };

  const brush = document.createElement("canvas");
  const paintRuns = (packed, at, colours) => {
    const [left, top, width, height, length] = boxAt(packed, at);
    if (!width || !height) return null;
    brush.width = width;
    brush.height = height;
    const pen = brush.getContext("2d");
    const picture = pen.createImageData(width, height);
    let pixel = 0;
    for (let index = at + 12; index < at + 12 + length; index += 1) {
      const colour = colours[views === packed ? packed[index] >> 6 : Math.min(1, packed[index] >> 6)];
      for (let left = (packed[index] & 63) + 1; left > 0; left -= 1, pixel += 4) {
        if (!colour) continue;
        picture.data[pixel] = colour[0];
        picture.data[pixel + 1] = colour[1];
        picture.data[pixel + 2] = colour[2];
        picture.data[pixel + 3] = 255;
      }
    }
    pen.putImageData(picture, 0, 0);
    const size = data.reduction;
    return [brush, left * size, top * size, width * size, height * size];
  };
  const props = bytes(data.props);
  const propStarts = starts(props);

  // the middle of the body in each kept frame, averaged over neighbours so that the picture does not shake
  const middlesOf = () => data.cameras.map((camera, index) => {
    const raw = [];
    for (let frame = 0; frame < kept; frame += 1) {
      const [left, top, width, height] = boxAt(views, viewStarts[frame * cameras + index]).map((n) => n * data.reduction);
      raw.push(width ? [left + width / 2, top + height / 2] : null);
    }
    return raw.map((_, frame) => {
      const near = raw.slice(Math.max(0, frame - 4), frame + 5).filter(Boolean);
      const mean = (axis) => near.reduce((sum, place) => sum + place[axis], 0) / near.length;
      return near.length ? [mean(0), mean(1)] : [camera.width / 2, camera.height / 2];
    });
  });

  const stage = section.querySelector(".views");
  const cards = data.cameras.map(() => {
    const card = document.createElement("div");
    const canvas = document.createElement("canvas");
    canvas.width = 360;
    canvas.height = 480;
    canvas.setAttribute("role", "img");
    const caption = document.createElement("p");
    card.append(canvas, caption);
    stage.append(card);
    return { canvas, caption, pen: canvas.getContext("2d") };
  });

  const bonesOf = (frame, camera, whose) => {
    const from = ((frame * cameras + camera) * 2 + whose) * MARKERS * 2;
    return (marker) => {
      const [x, y] = [points[from + 2 * marker], points[from + 2 * marker + 1]];
      return x === NOWHERE ? null : [x / 4, y / 4];
    };
  };
  const strokeBones = (pen, place, colour, scale, dashed) => {
    const lines = new Path2D();
    const joints = new Path2D();
    for (const [from, to] of data.bones.map((bone) => bone.map(place))) {
      if (!from || !to) continue;
      lines.moveTo(...from);
      lines.lineTo(...to);
      for (const [x, y] of [from, to]) {
        if (dashed) joints.rect(x - 4 / scale, y - 4 / scale, 8 / scale, 8 / scale);
        else { joints.moveTo(x + 4.4 / scale, y); joints.arc(x, y, 4.4 / scale, 0, 7); }
      }
    }
    pen.setLineDash(dashed ? [11 / scale, 8 / scale] : []);
    for (const [width, ink] of [[6, "#101820"], [3.2, colour]]) {
      pen.lineWidth = width / scale;
      pen.strokeStyle = ink;
      pen.stroke(lines);
    }
    pen.fillStyle = colour;
    pen.fill(joints);
  };

  const is = (name) => part(name).checked;
  const draw = (frame, index) => {
    const { canvas, pen } = cards[index];
    const camera = data.cameras[index];
    const span = is("whole") ? Math.max(camera.width, (camera.height * canvas.width) / canvas.height) : camera.span;
    const scale = canvas.width / span;
    const [x, y] = is("whole") ? [camera.width / 2, camera.height / 2] : middles[index][frame];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.fillStyle = "#0d1319";
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.setTransform(scale, 0, 0, scale, canvas.width / 2 - scale * x, canvas.height / 2 - scale * y);
    pen.fillStyle = data.colours.ground;
    pen.fillRect(0, 0, camera.width, camera.height);
    if (props.length) {
      const painted = paintRuns(props, propStarts[index], [null, data.colours.prop]);
      if (painted) pen.drawImage(...painted);
    }
    if (is("silhouettes")) {
      const painted = paintRuns(views, viewStarts[frame * cameras + index], [null, ...data.colours.labels.slice(1)]);
      if (painted) pen.drawImage(...painted);
    }
    if (is("skeletons")) {
      strokeBones(pen, bonesOf(frame, index, 0), data.colours.truth, scale, false);
      strokeBones(pen, bonesOf(frame, index, 1), data.colours.estimate, scale, true);
    }
    if (keypoints && is("keypoints")) {
      pen.setLineDash([]);
      for (const point of keypoints[frame][index]) markKeypoint(pen, point, 4 / scale);
    }
  };

  const axes = [...document.querySelectorAll(".timeline svg[data-axis]")].map((plot) => {
    const [left, right, top, bottom, from, to] = plot.dataset.axis.split(" ").map(Number);
    const cursor = document.createElementNS("http://www.w3.org/2000/svg", "line");
    cursor.setAttribute("class", "cursor");
    cursor.setAttribute("y1", top);
    cursor.setAttribute("y2", bottom);
    plot.append(cursor);
    return { plot, cursor, left, right, from, to, overFrames: plot.closest("figure").dataset.over === "frames" };
  }).filter((axis) => { if (!axis.overFrames) axis.cursor.remove(); return axis.overFrames; });

  const slider = part("slider");
  let shown = -1;
  const words = (value, unit) => (value === null || value === undefined ? "–" : `${value} ${unit}`);
  const show = (index) => {
    const frame = Math.max(0, Math.min(kept - 1, Math.round(index)));
    const number = frame * data.stride;
    shown = frame;
    slider.value = frame;
    const time = `${(number / data.fps).toFixed(2)} s`;
    const none = data.scored ? "not scored" : "";
    const error = data.error[frame] === null ? none : `error ${data.error[frame]} mm`;
    slider.setAttribute("aria-valuetext", [`frame ${number}`, time, error].filter(Boolean).join(", "));
    const measured = data.error[frame] === null ? none : `${data.error[frame]} mm`;
    part("readout").textContent = [`frame ${number}`, time, measured].filter(Boolean).join(" · ");
    cards.forEach(({ canvas, caption }, view) => {
      draw(frame, view);
      const camera = data.cameras[view];
      if (!data.scored) {
        // a tracked recording has overlaps, but no errors
        const seen = data.overlap[frame][view] === null ? "" : `overlap ${words(data.overlap[frame][view], "%")}`;
        caption.textContent = [camera.name, seen].filter(Boolean).join(" · ");
        canvas.setAttribute("aria-label", [`${camera.name}, frame ${number}`, seen].filter(Boolean).join(": "));
        return;
      }
      const overlap = words(data.overlap[frame][view], "%");
      const pixels = words(data.pixels[frame][view], "px");
      caption.textContent = `${camera.name} · overlap ${overlap} · ${pixels} off`;
      canvas.setAttribute("aria-label", `${camera.name}, frame ${number}: overlap ${overlap}, 2-D error ${pixels}, ${error}`);
    });
    for (const { cursor, left, right, from, to } of axes) {
      const x = left + ((right - left) * (number - from)) / (to - from);
      cursor.setAttribute("x1", x);
      cursor.setAttribute("x2", x);
    }
  };

  let next = 0;
  let ask = null;
  const soon = (frame) => {
    ask = frame;
    if (!next) next = requestAnimationFrame(() => { next = 0; show(ask); });
  };
  slider.addEventListener("input", () => { stop(); soon(Number(slider.value)); });
  part("back").addEventListener("click", () => { stop(); show(shown - 1); });
  part("on").addEventListener("click", () => { stop(); show(shown + 1); });
  for (const name of ["whole", "skeletons", "silhouettes", ...(keypoints ? ["keypoints"] : [])]) part(name).addEventListener("change", () => show(shown));

  let timer = 0;
  const play = part("play");
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = "▶";
    play.setAttribute("aria-label", "Play");
  };
  play.addEventListener("click", () => {
    if (timer) return stop();
    play.textContent = "❚❚";
    play.setAttribute("aria-label", "Pause");
    const [began, first] = [performance.now(), shown >= kept - 1 ? 0 : shown];
    timer = setInterval(() => {
      const frame = first + ((performance.now() - began) / 1000) * (data.fps / data.stride);
      if (frame >= kept - 1) { show(kept - 1); stop(); } else soon(frame);
    }, 1000 / Math.min(30, data.fps));
  });

  // dragging on a picture moves through time; up and down still scrolls the page
  cards.forEach(({ canvas }) => {
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      stop();
      held = [event.clientX, shown];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (held) soon(held[1] + ((event.clientX - held[0]) / canvas.clientWidth) * Math.max(30, kept / 4));
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
  });
  axes.forEach(({ plot, left, right, from, to }) => {
    const point = (event) => {
      const box = plot.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * plot.viewBox.baseVal.width;
      stop();
      soon((from + ((to - from) * (x - left)) / (right - left)) / data.stride);
    };
    plot.addEventListener("pointerdown", (event) => { plot.setPointerCapture(event.pointerId); point(event); });
    plot.addEventListener("pointermove", (event) => { if (event.buttons) point(event); });
  });
  const choice = part("choice");
  const take = (seed) => {
    stop();
    data = seeds[seed];
    views = bytes(data.views);
    points = new Int16Array(bytes(data.points).buffer);
    viewStarts = starts(views);
    kept = data.error.length;
    middles = middlesOf();
    slider.max = kept - 1;
    if (!choice) return;
    choice.value = seed;
    const least = data.error.some((error) => error !== null) ? "the seed with the median error" : "the first seed";
    part("seed").textContent = `, for ${seed ? "the seed with the worst frame" : least} (seed ${data.seed})`;
  };
  if (choice) seeds.forEach((one, index) => choice.append(new Option(`${one.seed}${index ? " (worst frame)" : " (median)"}`, index)));
  if (choice) part("seeds").hidden = seeds.length < 2;
  choice?.addEventListener("change", () => {
    const before = shown * data.stride;
    take(Number(choice.value));
    show(before / data.stride);
  });
  seeds.forEach((one, index) => {
    for (const row of document.querySelectorAll(`[data-seed="${one.seed}"][data-frame]`)) {
      row.hidden = false;
      row.addEventListener("click", () => {
        take(index);
        show(Number(row.dataset.frame) / data.stride);
        section.scrollIntoView({ block: "start" });
      });
    }
  });

  take(0);
  section.hidden = transport.hidden = false;
  show(data.scored ? data.error.reduce((worst, error, frame) => (error > (data.error[worst] ?? -1) ? frame : worst), 0) : 0);
};
playback();
