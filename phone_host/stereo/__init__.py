"""The stereo core: rectification, matching, reprojection on arrays. Only `images` reads files; `overheard` captures libraries' messages."""
