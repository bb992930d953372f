// Colours of the scene and the plots in light and dark.

export const THEMES = {
  light: {
    zenith: "#bcd3e3", horizon: "#eef3f6", deep: "#2f7488", shallow: "#a5cdd6", line: "#ffffff", shade: 0.3,
    sun: 2.3, sky: 1.5, ground: "#8fb0b8", ink: "#5b6875", rule: "#e3e8ec",
  },
  dark: {
    zenith: "#070b11", horizon: "#16202b", deep: "#0b2a38", shallow: "#1d4353", line: "#7fb4c8", shade: 0.55,
    sun: 1.7, sky: 0.9, ground: "#24404c", ink: "#92a1b0", rule: "#26313c",
  },
};

export function themeName() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
}

export const theme = () => THEMES[themeName()];

/** Call `listener` whenever light turns to dark or back. */
export function onThemeChange(listener) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", listener);
  new MutationObserver(listener).observe(document.documentElement, { attributeFilter: ["data-theme"] });
}

/** Buttons that choose between light and dark. */
export function themeButtons(root) {
  for (const button of root.querySelectorAll("[data-toggle-theme]")) {
    button.addEventListener("click", () => {
      document.documentElement.dataset.theme = themeName() === "dark" ? "light" : "dark";
    });
  }
}
