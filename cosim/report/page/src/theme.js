// Colours of the scene and the plots in light and dark.

export const THEMES = {
  light: {
    horizon: "#e9f0f4", deep: "#3c8196", shallow: "#b4d5dc", line: "#ffffff", shade: 0.22,
    sun: 1.9, sky: 1.75, ground: "#8fb0b8", ink: "#5b6875", rule: "#e3e8ec",
  },
  dark: {
    horizon: "#141d27", deep: "#0d2c3a", shallow: "#24505f", line: "#7fb4c8", shade: 0.4,
    sun: 1.5, sky: 1.25, ground: "#24404c", ink: "#92a1b0", rule: "#26313c",
  },
};

export function themeName() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
}

export const theme = () => THEMES[themeName()];

/** Call `listener` when the theme changes between light and dark. */
export function onThemeChange(listener) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", listener);
  new MutationObserver(listener).observe(document.documentElement, { attributeFilter: ["data-theme"] });
}

/** Buttons that switch between the light and the dark theme. */
export function themeButtons(root) {
  for (const button of root.querySelectorAll("[data-toggle-theme]")) {
    button.addEventListener("click", () => {
      document.documentElement.dataset.theme = themeName() === "dark" ? "light" : "dark";
    });
  }
}
