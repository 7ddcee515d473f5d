// the layers over the silhouettes, and the rig from above
window.playbackExtras = (() => {
  const json = (name) => JSON.parse(document.getElementById(name)?.textContent || "null");
  const [layers, map] = [json("layers-data"), json("map-data")];
  const select = document.querySelector('[data-is="layer"]');
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

  return {
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
