"""The stereo core: rectification, matching, reprojection: functions on arrays. Only `images` reads files, and `overheard` listens to image libraries."""
