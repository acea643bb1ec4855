"""The page in a browser: Chromium by Playwright, the real server, rendered scenes. Part `web` of CI."""
