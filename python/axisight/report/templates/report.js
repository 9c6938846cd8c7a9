(function () {
  "use strict";
  // Without this script the page is whole: it adds values under the pointer and a closer look.
  var HINT = window.matchMedia("(hover: hover)").matches ?
    "Point at the curves for values; drag along them for a closer look at that time, double click for all of it." :
    "Touch the curves for values.";

  function made(parent, name, attributes) {
    var element = document.createElementNS(parent.namespaceURI, name);
    Object.keys(attributes).forEach(function (key) { element.setAttribute(key, attributes[key]); });
    return parent.appendChild(element);
  }

  // Points of a path as pieces of whole numbers: "M x y l dx dy ...".
  function points(path) {
    var xs = [], ys = [];
    path.getAttribute("d").split("M").slice(1).forEach(function (piece) {
      var x = 0, y = 0, numbers = piece.match(/-?\d+/g).map(Number);
      for (var i = 0; i < numbers.length; i += 2) {
        xs.push(x += numbers[i]);
        ys.push(y += numbers[i + 1]);
      }
    });
    return { xs: xs, ys: ys };
  }

  function nearest(xs, x) {
    var low = 0, high = xs.length - 1;
    while (high - low > 1) {
      var middle = (low + high) >> 1;
      if (xs[middle] < x) { low = middle; } else { high = middle; }
    }
    return x - xs[low] < xs[high] - x ? low : high;
  }

  function shown(value, span) {
    var digits = Math.min(9, Math.max(0, 3 - Math.floor(Math.log10(span))));
    return value.toFixed(digits).replace("-", "\u2212");
  }

  function Panel(svg) {
    var box = svg.getAttribute("viewBox").split(" ").map(Number);
    var low = Number(svg.dataset.low), high = Number(svg.dataset.high);
    var lines = null;
    this.width = box[2];
    this.look = function (from, to) {
      svg.setAttribute("viewBox", [from, 0, to - from, box[3]].join(" "));
    };
    this.values = function (x, unit) {
      lines = lines || Array.prototype.map.call(svg.querySelectorAll("path"), function (path) {
        return { kind: path.classList[1], points: points(path) };
      });
      return lines.filter(function (line) { return line.points.xs.length; }).map(function (line) {
        var y = line.points.ys[nearest(line.points.xs, x)];
        return line.kind + " " + shown(high - (high - low) * y / box[3], high - low) + unit;
      }).join(", ");
    };
  }

  function times(group, height, labelled, from, to) {
    var step = Math.pow(10, Math.floor(Math.log10((to - from) / 6)));
    step *= [1, 2, 5, 10].filter(function (f) { return f * step >= (to - from) / 6; })[0];
    var digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    group.textContent = "";
    for (var i = Math.ceil(from / step); i * step <= to; i += 1) {
      var x = 100 * (i * step - from) / (to - from) + "%";
      made(group, "line", { "class": "grid", x1: x, x2: x, y2: height });
      if (labelled) {
        made(group, "text", { x: x, y: height + 17, "text-anchor": "middle" }).textContent =
          (i * step).toFixed(digits).replace("-", "\u2212");
      }
    }
  }

  function Figure(plot) {
    var panels = Array.prototype.map.call(plot.querySelectorAll(".panel"), function (svg) { return new Panel(svg); });
    var frames = plot.querySelectorAll(".frame");
    var start = Number(plot.dataset.start), stop = Number(plot.dataset.stop);
    var view = [0, 1], begun = null;
    var height = plot.getAttribute("height") - 48;
    var chosen = made(plot, "rect", { "class": "chosen", y: 8, height: height - 8, width: 0 });
    var cursor = made(plot, "line", { "class": "cursor", y1: 8, y2: height, visibility: "hidden" });
    var readout = plot.parentNode.appendChild(document.createElement("p"));
    readout.className = "readout soft small";
    readout.textContent = HINT;

    function look(from, to) {
      view = [from, to];
      panels.forEach(function (panel) { panel.look(panel.width * from, panel.width * to); });
      var span = stop - start;
      Array.prototype.forEach.call(plot.querySelectorAll(".times"), function (group, i) {
        times(group, Number(frames[i].getAttribute("height")), i === frames.length - 1,
          start + from * span, start + to * span);
      });
    }
    function across(event) {
      var box = frames[0].getBoundingClientRect();
      return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    }
    function within(share) { return view[0] + share * (view[1] - view[0]); }
    function read(share) {
      var at = within(share);
      cursor.setAttribute("x1", 100 * share + "%");
      cursor.setAttribute("x2", 100 * share + "%");
      cursor.setAttribute("visibility", "visible");
      var told = panels.map(function (panel) { return panel.values(at * panel.width, plot.dataset.unit); });
      readout.textContent = "At " + shown(start + at * (stop - start), (stop - start) * (view[1] - view[0])) +
        " s: " + told[0] + "; error " + told.slice(1).join("");
    }
    plot.addEventListener("pointermove", function (event) {
      var share = across(event);
      read(share);
      if (begun !== null) {
        chosen.setAttribute("x", 100 * Math.min(begun, share) + "%");
        chosen.setAttribute("width", 100 * Math.abs(share - begun) + "%");
      }
    });
    plot.addEventListener("pointerdown", function (event) {
      read(across(event));
      // A finger scrolls the page.
      if (event.pointerType !== "mouse" || event.button !== 0) { return; }
      begun = across(event);
      plot.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    plot.addEventListener("pointerup", function (event) {
      var ended = across(event), from = within(Math.min(begun, ended)), to = within(Math.max(begun, ended));
      // A click is no choice, and beyond a thousandth of the time there is nothing to see.
      if (begun !== null && Math.abs(ended - begun) > 0.01 && to - from > 0.001) { look(from, to); }
      begun = null;
      chosen.setAttribute("width", 0);
    });
    plot.addEventListener("dblclick", function () { look(0, 1); });
    plot.addEventListener("pointerleave", function (event) {
      // What a finger asked for is read when it is gone.
      if (event.pointerType === "touch") { return; }
      cursor.setAttribute("visibility", "hidden");
      readout.textContent = HINT;
    });
  }
  Array.prototype.forEach.call(document.querySelectorAll(".plot"), function (plot) { new Figure(plot); });

  var opened = [];
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.slice.call(document.querySelectorAll("details:not([open]):not(.log)"));
    opened.forEach(function (element) { element.open = true; });
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (element) { element.open = false; });
  });
})();
