
(() => {
  const of = document.getElementById("case"), by = document.getElementById("method");
  if (!of) return;
  const groups = [...document.querySelectorAll("[data-figures]")];
  const none = document.getElementById("no-figures");
  const show = () => {
    const wanted = of.value + " " + by.value;
    let found = false;
    for (const group of groups) {
      group.hidden = group.dataset.figures !== wanted;
      found = found || !group.hidden;
    }
    none.hidden = found;
  };
  of.addEventListener("change", show);
  by.addEventListener("change", show);
  show();
})();
