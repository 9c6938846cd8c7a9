(function () {
  "use strict";
  var table = document.getElementById("cases");
  var body = table.tBodies[0];
  var heads = Array.prototype.slice.call(table.tHead.rows[0].cells);
  var rows = Array.prototype.slice.call(body.rows);
  var find = document.getElementById("find");
  var verdict = document.getElementById("verdict");
  var count = document.getElementById("count");
  function key(row, column) {
    var cell = row.cells[column];
    return cell.dataset.key === undefined ? cell.textContent : Number(cell.dataset.key || "NaN");
  }
  function order(a, b) {
    // What has no number comes last either way.
    if (typeof a === "number") { return (isNaN(a) - isNaN(b)) || a - b; }
    return a.localeCompare(b, undefined, { numeric: true });
  }
  heads.forEach(function (head, column) {
    head.querySelector("button").addEventListener("click", function () {
      var down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach(function (other) { other.removeAttribute("aria-sort"); });
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      rows.sort(function (a, b) {
        var x = key(a, column), y = key(b, column);
        var known = order(x, y);
        return down && !(typeof x === "number" && (isNaN(x) || isNaN(y))) ? -known : known;
      });
      rows.forEach(function (row) { body.appendChild(row); });
    });
  });
  function show() {
    var words = find.value.toLowerCase().split(/\s+/);
    var shown = 0;
    rows.forEach(function (row) {
      var text = row.textContent.toLowerCase();
      var fits = words.every(function (word) { return text.indexOf(word) >= 0; }) &&
        (!verdict.value || row.dataset.verdict === verdict.value);
      row.hidden = !fits;
      shown += fits ? 1 : 0;
    });
    count.textContent = shown + " of " + rows.length + " rows";
  }
  find.addEventListener("input", show);
  verdict.addEventListener("change", show);
  show();
}());
