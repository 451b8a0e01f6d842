// Light and dark, and which curves are shown.
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
})();
