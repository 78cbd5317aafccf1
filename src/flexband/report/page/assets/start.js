// Reads the data of the page and starts its parts.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

flexband.ready = (async function () {
  const text = document.getElementById("data").textContent;
  flexband.data = await flexband.unpackedTree(JSON.parse(text));
  for (const start of flexband.starters) start(flexband.data);
})();

flexband.color = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** Return an element with a text and attributes. */
flexband.element = function (tag, text = "", attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
};
