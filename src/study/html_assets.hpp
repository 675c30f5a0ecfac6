// What the study's page adds to the frame of all pages.
#pragma once

#include <string_view>

namespace unflex::study {

inline constexpr std::string_view kStyle = R"css(
.lead { font-size: 1.15rem; max-width: 60ch; }
.bars { display: grid; grid-template-columns: max-content 1fr; gap: .3rem .8rem; align-items: center; }
.bars .bar { display: flex; align-items: center; gap: .5rem; min-width: 0; }
.bars .bar i { display: block; height: .9rem; border-radius: 3px; background: var(--series-6); width: calc(var(--share) * (100% - 6rem)); min-width: 2px; }
.bars .bar.before i { background: var(--before); }
.bars .bar.after i { background: var(--after); }
.wide { max-width: 42rem; }
table.data tr.unflex > * { font-weight: 600; }
table.data td.none { color: var(--muted); }
.choose { display: flex; flex-wrap: wrap; gap: .6rem 1.2rem; margin: 0 0 .75rem; }
.choose label { display: flex; gap: .5rem; align-items: center; }
.choose select { background: var(--raised); border: 1px solid var(--line); border-radius: 8px; padding: .3rem .5rem; min-height: 2.2rem; max-width: 100%; }
.plots { display: grid; gap: var(--gap); grid-template-columns: repeat(auto-fill, minmax(min(20rem, 100%), 1fr)); margin-top: .6rem; }
.plots figure { margin: 0; min-width: 0; }
.plots figcaption { font-size: .9rem; color: var(--muted); }
@media (max-width: 40rem) { .bars { grid-template-columns: 1fr; gap: 0; } .bars .bar { margin-bottom: .4rem; } }
)css";

// Shows the figures of the chosen case by the chosen method. Cases 5A and 5B differ from the
// reference only in the thesis' own methods. Other methods have no figures there.
inline constexpr std::string_view kScript = R"js(
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
)js";

}  // namespace unflex::study
