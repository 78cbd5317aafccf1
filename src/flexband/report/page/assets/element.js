// Elements of the page.
"use strict";
window.flexband = window.flexband || {};

/** Return a new element with properties, attributes ("aria-label") and children. */
flexband.element = function (tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "role" || name === "for") made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children);
  return made;
};
