// the layers over the silhouettes, the keypoints, and the rig from above
window.playbackExtras = (() => {
  const json = (name) => JSON.parse(document.getElementById(name)?.textContent || "null");
  const [layers, keypoints, map] = [json("layers-data"), json("keypoints-data"), json("map-data")];
  const select = document.querySelector('[data-is="layer"]');
  const marked = document.querySelector('[data-is="keypoints"]');
  const meaning = document.querySelector('[data-is="meaning"]');
  const known = new Map();

  const picture = (entry) => {
    if (!known.has(entry)) {
      const image = new Image();
      image.onload = () => window.playbackExtras.redraw?.();
      image.src = `data:image/png;base64,${entry.png}`;
      known.set(entry, image);
    }
    return known.get(entry);
  };
  const chosen = (frame, view) => {
    if (!layers || select.value === "") return null;
    const sample = Math.min(layers.pictures.length - 1, Math.floor(frame / layers.stride));
    return { entry: layers.pictures[sample][view][Number(select.value)], frame: layers.frames[sample] };
  };
  select?.addEventListener("change", () => {
    meaning.textContent = select.value === "" ? "" : layers.meanings[Number(select.value)];
    window.playbackExtras.redraw?.();
  });

  marked?.addEventListener("change", () => window.playbackExtras.redraw?.());
  // a disc for what is visible, a ring for what is hidden, a cross for what is another side's or person's
  const mark = (pen, [x, y, kind], size) => {
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

  return {
    mark: (pen, frame, view) => {
      if (!keypoints || !marked.checked) return;
      pen.setLineDash([]);
      for (const point of keypoints[frame][view]) mark(pen, point, 4 / pen.getTransform().a);
    },
    draw: (pen, frame, view) => {
      const entry = chosen(frame, view)?.entry;
      if (!entry) return;
      const image = picture(entry);
      if (!image.complete || !image.naturalWidth) return;
      pen.imageSmoothingEnabled = false;
      pen.drawImage(image, entry.x, entry.y, entry.width, entry.height);
      pen.imageSmoothingEnabled = true;
    },
    words: (frame, view) => {
      const layer = chosen(frame, view);
      if (!layer) return "";
      return layer.entry ? `layer of frame ${layer.frame}` : `no layer in frame ${layer.frame}`;
    },
    show: (frame) => {
      const place = map?.roots[frame];
      const dot = document.querySelector('.map [data-is="root"]');
      if (dot) dot.setAttribute("visibility", place ? "visible" : "hidden");
      if (dot && place) {
        dot.setAttribute("cx", place[0]);
        dot.setAttribute("cy", place[1]);
      }
      (map?.fields[frame] || []).forEach((points, camera) => {
        const group = document.querySelector(`.map [data-camera="${camera}"]`);
        if (!points || !group) return;
        group.querySelector("polygon").setAttribute("points", points);
        const [x, y] = points.split(" ")[0].split(",");
        group.querySelector("circle").setAttribute("cx", x);
        group.querySelector("circle").setAttribute("cy", y);
        group.querySelector("text").setAttribute("x", x);
        group.querySelector("text").setAttribute("y", y);
      });
    },
  };
})();
