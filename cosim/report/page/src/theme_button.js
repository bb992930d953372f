// The button that switches between the light and the dark theme.

export function themeName() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
}

/** Buttons that switch between the light and the dark theme. */
export function themeButtons(root) {
  for (const button of root.querySelectorAll("[data-toggle-theme]")) {
    button.addEventListener("click", () => {
      document.documentElement.dataset.theme = themeName() === "dark" ? "light" : "dark";
    });
  }
}
