(function () {
  "use strict";
  // Nothing leaves the page: plotly would offer to upload a chart to its makers.
  var config = { responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  function data(id) {
    var element = document.getElementById(id);
    return element ? JSON.parse(element.textContent) : null;
  }
  function draw(id, figure, changed) {
    return Plotly.react(id, figure.data, figure.layout, Object.assign({}, config, changed));
  }
  var ranking = data("ranking-data");
  if (ranking && document.getElementById("ranking-figure")) {
    // There is nothing to zoom in a ranking.
    draw("ranking-figure", ranking, { displayModeBar: false });
  }

  var overlays = data("overlay-data");
  var logs = document.getElementById("overlay-log");
  var axes = document.getElementById("overlay-axis");
  function offer(axis) {
    var log = Number(logs.value);
    var known = overlays.items.filter(function (item) { return item.log === log; })
      .map(function (item) { return item.axis; });
    Array.prototype.forEach.call(axes.options, function (option) {
      option.disabled = known.indexOf(Number(option.value)) < 0;
    });
    axes.value = String(known.indexOf(axis) < 0 ? known[0] : axis);
  }
  function show() {
    var found = overlays.items.filter(function (item) {
      return item.log === Number(logs.value) && item.axis === Number(axes.value);
    })[0];
    if (found) { draw("overlay-figure", found.figure); }
  }
  if (overlays && logs && axes) {
    var first = overlays.items[overlays.first];
    logs.value = String(first.log);
    offer(first.axis);
    logs.addEventListener("change", function () { offer(Number(axes.value)); show(); });
    axes.addEventListener("change", show);
    show();
  }

  function fit(width) {
    ["ranking-figure", "overlay-figure"].forEach(function (id) {
      var element = document.getElementById(id);
      if (element && element.layout) { Plotly.relayout(element, { width: width, autosize: !width }); }
    });
  }
  var opened = [];
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.slice.call(document.querySelectorAll("details:not([open])"));
    opened.forEach(function (element) { element.open = true; });
    fit(680);
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (element) { element.open = false; });
    fit(null);
  });
})();
