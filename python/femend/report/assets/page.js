// Light and dark, which curves are shown, and values under the pointer.
(function () {
  "use strict";
  const root = document.documentElement;
  const recolour = () => window.femendRecolour && window.femendRecolour();
  const button = document.getElementById("theme");
  const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
  button.hidden = false;
  button.addEventListener("click", () => {
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : prefersDark.matches;
    root.dataset.theme = dark ? "light" : "dark";
    recolour();
  });
  prefersDark.addEventListener("change", recolour);
  for (const input of document.querySelectorAll(".legend input"))
    input.addEventListener("change", () => {
      root.classList.toggle("hide-" + input.value, !input.checked);
      for (const twin of document.querySelectorAll(`.legend input[value="${input.value}"]`)) twin.checked = input.checked;
    });

  // Values under the pointer: a cross on the axes it is over, and what they read there.
  const text = (value) => (value === 0 ? "0" : Number(value.toPrecision(4)).toString().replace("-", "\u2212"));
  const at = (share, low, high, log) => (log ? low * Math.pow(high / low, share) : low + share * (high - low));
  for (const plot of document.querySelectorAll("svg[data-axes]")) {
    const axes = JSON.parse(plot.dataset.axes);
    const make = (name, css) => {
      const part = document.createElementNS(plot.namespaceURI, name);
      part.setAttribute("class", css);
      return plot.appendChild(part);
    };
    let cross = null, words = null;
    const hide = () => { if (cross) { cross.setAttribute("d", ""); words.textContent = ""; } };
    plot.addEventListener("pointerleave", hide);
    plot.addEventListener("pointermove", (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
      const found = axes.find(([l, t, w, h]) => point.x >= l && point.x <= l + w && point.y >= t && point.y <= t + h);
      if (!found) { hide(); return; }
      const [left, top, width, height, x0, x1, y0, y1, logX, logY, unitX, unitY] = found;
      cross = cross || make("path", "cross");
      words = words || make("text", "name");
      const x = at((point.x - left) / width, x0, x1, logX), y = at(1 - (point.y - top) / height, y0, y1, logY);
      cross.setAttribute("d", `M${point.x} ${top}v${height}M${left} ${point.y}h${width}`);
      words.textContent = `${text(x)} ${unitX},  ${text(y)} ${unitY}`;
      words.setAttribute("text-anchor", "end");
      words.setAttribute("x", left + width);
      words.setAttribute("y", top - 7);
    });
  }
})();
