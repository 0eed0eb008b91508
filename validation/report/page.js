/* Search and filters: rows that do not fit are hidden, and so is what holds none that fits. */
const form = document.getElementById("find"), { text, place, status, grounds } = form.elements;
const MOST_OPEN = 300; /* so many rows are unfolded at once; of more, only their number is told */
const cases = [...document.querySelectorAll("section.case")].map(section => {
  const fold = section.querySelector("details.fold");
  const groups = [...fold.querySelectorAll("tbody")].map(group => ({
    group, rows: [...group.querySelectorAll("tr[id]")].map(element => ({
      element, words: element.textContent.toLowerCase(),
      status: element.querySelector(".chip").textContent, grounds: element.querySelector(".g").textContent })) }));
  return { section, fold, groups, open: fold.open, fit: fold.querySelector(".fit"),
    places: ["", section.id, section.parentElement.id] };
});
const all = document.querySelectorAll("section.case tr[id]").length;

function find() {
  const words = text.value.toLowerCase().split(/\s+/).filter(Boolean);
  const finding = Boolean(words.length || place.value || status.value || grounds.value);
  const fits = each => words.every(word => each.words.includes(word)) &&
    [each.status, ""].includes(status.value) && [each.grounds, ""].includes(grounds.value);
  const counts = cases.map(each => {
    const inside = each.places.includes(place.value);
    const counts = each.groups.map(({ rows }) => rows.filter(row => row.fits = inside && fits(row)).length);
    if (counts.some(Boolean)) each.groups.forEach(({ group, rows }, i) => { /* else the whole case is hidden */
      group.hidden = !counts[i];
      for (const row of rows) if (row.element.hidden == row.fits) row.element.hidden = !row.fits;
    });
    return counts.reduce((sum, count) => sum + count, 0);
  });
  const total = counts.reduce((sum, count) => sum + count, 0);
  cases.forEach((each, i) => {
    each.section.hidden = !counts[i];
    each.fold.open = finding ? counts[i] > 0 && total <= MOST_OPEN : each.open;
    each.fit.textContent = finding ? `, ${counts[i]} shown` : "";
  });
  for (const system of document.querySelectorAll("section.system")) system.hidden = !system.querySelector("section.case:not([hidden])");
  document.body.classList.toggle("finding", finding);
  form.querySelector("output").textContent = !finding ? "" : total ? `${total} of ${all} rows` : "No row fits: try fewer words, or clear the filters.";
  const top = document.getElementById("search").offsetTop;
  if (finding) scrollTo(0, top);
}

function clear(wanted = "") {
  for (const field of [text, place, grounds]) field.value = "";
  status.value = wanted;
  find();
}

function show() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  if (!target.offsetParent && document.body.classList.contains("finding")) clear();
  for (let box = target.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
  target.scrollIntoView();
}

form.hidden = false;
document.querySelector("nav details").open = matchMedia("(min-width: 72rem)").matches;
form.addEventListener("input", find);
form.elements.clear.addEventListener("click", () => clear());
form.addEventListener("submit", event => event.preventDefault());
for (const tile of document.querySelectorAll("a.tile")) tile.addEventListener("click", () => clear(tile.dataset.status));
for (const name of ["hashchange", "load"]) addEventListener(name, show);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(box => box.open = true));
