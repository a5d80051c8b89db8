// The page: cases open and close, the list is filtered, targets are enlarged.

async function open(details) {
  const root = details.querySelector(".viewer");
  if (!root?.hidden || root.dataset.ready) return;
  root.dataset.ready = "yes";
  const numbers = await numbersOf(root);
  root.hidden = false;
  details.classList.add("live");
  new Viewer(root, numbers);
}

function reach(hash) {
  const details = /^#case-\d+$/.test(hash) && document.querySelector(hash);
  if (!details) return;
  details.open = true;
  details.scrollIntoView();
}

/** Viewers are made when they come near the screen: a page may hold hundreds. */
const near = new IntersectionObserver(
  (seen) => seen.filter((entry) => entry.isIntersecting).forEach((entry) => entry.target.open && open(entry.target)),
  { rootMargin: "800px" },
);

for (const details of document.querySelectorAll("details.case")) {
  near.observe(details);
  details.addEventListener("toggle", () => details.open && open(details));
}

for (const link of document.querySelectorAll(".lines a"))
  link.addEventListener("click", () => reach(link.getAttribute("href")));
addEventListener("hashchange", () => reach(location.hash));
reach(location.hash);

const filter = document.querySelector(".filter");
if (filter) {
  filter.hidden = false;
  const lines = [...document.querySelectorAll(".lines li")], sections = [...document.querySelectorAll("details.case")];
  const sift = () => {
    const kind = filter.querySelector("input:checked").value;
    const part = filter.querySelector("[type=search]").value.toLowerCase();
    const kept = lines.map((line) => (kind === "every" || line.dataset.kind === kind) && line.dataset.name.includes(part));
    kept.forEach((keep, k) => (lines[k].hidden = sections[k].hidden = !keep));
    const count = kept.filter(Boolean).length;
    filter.querySelector(".found").textContent = count === lines.length ? "" : `${count} of ${lines.length} shown`;
  };
  filter.addEventListener("input", sift);
}

const dialog = document.querySelector(".enlarged");
for (const button of document.querySelectorAll(".target"))
  button.addEventListener("click", () => {
    const picture = button.querySelector("img").cloneNode();
    const caption = document.createElement("figcaption");
    caption.textContent = picture.alt;
    dialog.querySelector("figure").replaceChildren(picture, caption);
    dialog.showModal();
  });
dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
