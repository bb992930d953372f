"""Scripts that a browser runs to find what is wrong with the layout of a page."""

#: ratio of the luminances of every visible text and its background (WCAG 2.2, 1.4.3), those below
#: the limit
LOW_CONTRAST = """() => {
  const canvas = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
  const rgba = (css) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = css;
    canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data];
  };
  const linear = (v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = (rgb) => rgb.slice(0, 3).map((v) => linear(v / 255))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const colour = rgba(getComputedStyle(e).backgroundColor);
      if (colour[3] > 200) return colour;
    }
    return [255, 255, 255];
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), low = [];
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement, style = getComputedStyle(element);
    const shown = texts.currentNode.data.trim() && element.getClientRects().length;
    if (!shown || element.closest("script, style, .drawn, svg, :disabled")) continue;
    const [one, other] = [light(rgba(style.color)), light(behind(element))].sort((a, b) => b - a);
    const large = parseFloat(style.fontSize) >= 24, ratio = (one + 0.05) / (other + 0.05);
    if (ratio < (large ? 3 : 4.5)) low.push([texts.currentNode.data.trim().slice(0, 30), ratio]);
  }
  return low;
}"""

#: texts whose box ends outside of the window or of its card
OVERFLOWING = """() => {
  const parts = [...document.querySelectorAll(
    ".card *, .verdict, .chip, .facts *, .bar > *, .tools *, .plot figcaption *"
  )].filter((element) => !element.closest("datalist, option, wbr"));
  return parts.filter((element) => {
    const inner = element.getBoundingClientRect();
    const outer = (element.closest(".card") ?? document.body).getBoundingClientRect();
    return inner.right > outer.right + 0.5 || inner.left < outer.left - 0.5;
  }).map((element) => element.className || element.tagName);
}"""

#: controls that Tab does not reach, or that have no name
UNREACHABLE = """() => [...document.querySelectorAll("button, select, input, summary")]
  .filter((element) => element.getClientRects().length && !element.disabled)
  .filter((element) => {
    const name = element.ariaLabel || element.title || element.textContent.trim();
    return element.tabIndex < 0 || !name;
  })
  .map((element) => element.outerHTML.slice(0, 80))"""
