const dialog = document.querySelector("dialog");
const cells = [...document.querySelectorAll(".column button, .worst-frames button[data-caption]")];
let shown = 0;
const show = (index) => {
  shown = (index + cells.length) % cells.length;
  const image = dialog.querySelector("img");
  image.src = cells[shown].querySelector("img").src;
  image.alt = cells[shown].querySelector("img").alt;
  dialog.querySelector("p").textContent = cells[shown].dataset.caption;
  if (!dialog.open) dialog.showModal();
};
cells.forEach((cell, index) => cell.addEventListener("click", () => show(index)));
dialog.addEventListener("click", () => dialog.close());
dialog.addEventListener("keydown", (event) => {
  const cameras = cells[shown].parentElement.querySelectorAll("button[data-caption]").length;
  const step = { ArrowUp: -1, ArrowDown: 1, ArrowLeft: -cameras, ArrowRight: cameras }[event.key];
  if (step) { event.preventDefault(); show(shown + step); }
});
