// Colours of the page: light, dark, and those of paper.
"use strict";
window.flexband = window.flexband || {};

flexband.color = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** Return whether the page is being printed: in light colours, with charts as wide as a page. */
flexband.printing = () => document.documentElement.classList.contains("printing");

/** Size of a chart on paper [pixels of CSS]: as wide as A4 and Letter within usual margins. */
flexband.PAPER = { width: 690, height: 345 };

flexband.painters = [];

/** Call a function that draws a part of the page whenever its colours change.
 *
 * It must draw at once: what is drawn later is missing on paper.
 */
flexband.whenColorsChange = (paint) => flexband.painters.push(paint);

(function () {
  const paint = () => flexband.painters.forEach((own) => own());
  for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
    addEventListener(event, () => {
      document.documentElement.classList.toggle("printing", printing);
      paint();
    });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paint);
})();
