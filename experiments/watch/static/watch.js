"use strict";
const SILENT_MS = 5000;  // a word comes each second
const lost = document.getElementById("lost");
const source = new EventSource("events");
let heard_ms = Date.now();
function heard() { heard_ms = Date.now(); lost.hidden = true; }
source.onopen = heard;
source.onerror = () => { lost.hidden = false; };
source.addEventListener("alive", heard);
for (const part of ["summary", "open", "finished"]) {
  source.addEventListener(part, (event) => {
    heard();
    document.getElementById(part).innerHTML = event.data;
  });
}
setInterval(() => { if (Date.now() - heard_ms > SILENT_MS) { lost.hidden = false; } }, 500);
