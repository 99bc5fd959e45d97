"use strict";
const lost = document.getElementById("lost");
const source = new EventSource("events");
source.onopen = () => { lost.hidden = true; };
source.onerror = () => { lost.hidden = false; };
for (const part of ["summary", "open", "finished"]) {
  source.addEventListener(part, (event) => { document.getElementById(part).innerHTML = event.data; });
}
