// The script of pages without a replay.
import { themeButtons } from "./theme_button.js";

themeButtons(document);
