// Draws the figures of the page, in the colours of the page, and again when these change.
"use strict";
(() => {
  const LIGHT = { ink: "#1b1f24", grid: "#e3e7eb", line: "#8c959f", hover: "#ffffff" };
  const DARK = { ink: "#e6e9ec", grid: "#2c3238", line: "#6e7781", hover: "#1e2226" };
  const BLACK = '"#000000"';
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const print = window.matchMedia("print");
  const config = {
    responsive: true,
    displaylogo: false,
    showTips: false,
    modeBarButtons: [["toImage"], ["zoom2d", "pan2d", "resetScale2d"]],
  };
  const places = [...document.querySelectorAll(".plot")].map((div) => ({
    div,
    figures: JSON.parse(document.getElementById(`data-${div.id}`).textContent).map(JSON.stringify),
    select: document.getElementById(`select-${div.dataset.choice}`),
  }));

  function themed(layout, colors) {
    const own = { ...layout, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)" };
    own.font = { ...layout.font, color: colors.ink, family: getComputedStyle(document.body).fontFamily, size: 13 };
    own.modebar = { bgcolor: "rgba(0,0,0,0)", color: colors.line, activecolor: colors.ink };
    own.hoverlabel = { ...layout.hoverlabel, bgcolor: colors.hover, font: { color: colors.ink } };
    for (const key of Object.keys(own).filter((name) => /^[xy]axis\d*$/.test(name))) {
      own[key] = { ...own[key], gridcolor: colors.grid, linecolor: colors.line, zerolinecolor: colors.grid };
    }
    return own;
  }

  function draw({ div, figures, select }, colors) {
    const text = figures[select ? Number(select.value) : 0];
    const figure = JSON.parse(text.replaceAll(BLACK, JSON.stringify(colors.ink)));
    return Plotly.react(div, figure.data, themed(figure.layout, colors), config);
  }

  const drawAll = (colors) => places.forEach((place) => draw(place, colors));
  const current = () => (dark.matches && !print.matches ? DARK : LIGHT);
  drawAll(current());
  places.filter(({ select }) => select).forEach((place) => {
    place.select.addEventListener("change", () => draw(place, current()));
  });
  for (const media of [dark, print]) media.addEventListener("change", () => drawAll(current()));
  window.addEventListener("beforeprint", () => drawAll(LIGHT));
})();
