// Wide tables scroll, by the keys too: the theme puts them into a box that cannot be focused.
(function () {
  "use strict";
  function reach() {
    document.querySelectorAll(".md-typeset__scrollwrap:not([tabindex])").forEach(function (box) {
      box.tabIndex = 0;
    });
  }
  new MutationObserver(reach).observe(document.body, { childList: true, subtree: true });
  reach();
}());
