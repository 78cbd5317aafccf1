// Reads the data of the page and starts its parts.
"use strict";
window.flexband = window.flexband || {};
flexband.starters = flexband.starters || [];

flexband.ready = (async function () {
  const text = document.getElementById("data").textContent;
  flexband.data = await flexband.unpackedTree(JSON.parse(text));
  for (const start of flexband.starters) start(flexband.data);
})();
