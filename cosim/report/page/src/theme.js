// Colours of the scene and the plots in light and dark.
import { Vector3 } from "three";
import { themeName } from "./theme_button.js";

/** Direction to the sun. */
export const SUN = new Vector3(-0.45, -0.6, 0.66).normalize();

export const THEMES = {
  light: {
    horizon: "#d5e4ef",
    zenith: "#7fb0dc",
    deep: "#1d5468",
    hill: "#5f8a7f",
    beach: "#cbb98c",
    meadow: "#7d9a4c",
    trees: ["#2f6b3a", "#3f7f3f", "#5f8f3f"],
    shade: 0.3,
    sun: 1.9,
    sky: 1.75,
    ground: "#6d98a4",
    ink: "#5b6875",
    rule: "#e3e8ec",
  },
  dark: {
    horizon: "#2a3a4a",
    zenith: "#0b1420",
    deep: "#0a1c27",
    hill: "#16262c",
    beach: "#3a3a34",
    meadow: "#1e2d25",
    trees: ["#12241f", "#172b22", "#1d3025"],
    shade: 0.45,
    sun: 1.5,
    sky: 1.25,
    ground: "#24404c",
    ink: "#92a1b0",
    rule: "#26313c",
  },
};

export const theme = () => THEMES[themeName()];

/** Call `listener` when the theme changes between light and dark. */
export function onThemeChange(listener) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", listener);
  new MutationObserver(listener).observe(document.documentElement, {
    attributeFilter: ["data-theme"],
  });
}
