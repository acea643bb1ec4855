"""What is fuzzed, and what every reader must guarantee for any input: only documented errors, nothing delivered altered, no growth.

A target takes any bytes and raises only if something is wrong. The same functions run in `make fuzz`, guided by
coverage, and in the test suite over the corpus, which holds every input that ever found something.
"""

from tests.fuzz import browser, inputs, protocols, rig_files
from tests.fuzz.target import Target

TARGETS: dict[str, Target] = {
    "deframer": Target("units in a byte stream", protocols.deframer, protocols.deframer_seeds, 65_536, 0.5),
    "wire": Target("message headers", protocols.wire, protocols.wire_seeds, 16_384, 0.5),
    "line": Target(
        "chunks, contact and pacing behind sound checks", protocols.line, protocols.line_seeds, 16_384, 0.02
    ),
    "session": Target("both roles of a session and the clock", protocols.session, protocols.session_seeds, 8192, 0.005),
    "pairing": Target("words of pairing", protocols.pairing, protocols.pairing_seeds, 2048, 0.005),
    "doors": Target("ZAP requests and SDP records", protocols.doors, protocols.doors_seeds, 1024, 0.005),
    "uri": Target("link and camera URIs", inputs.uri, inputs.uri_seeds, 300, 0.01),
    "v4l2": Target("a driver's controls and stamps", inputs.v4l2, inputs.v4l2_seeds, 2048, 0.005),
    "image": Target("JPEG, PNG and PNM headers", inputs.image, inputs.image_seeds, 4096, 0.005),
    "decode": Target("sizes of images, and decoding them", inputs.decoding, inputs.decoding_seeds, 4096, 0.005),
    "browser": Target("a browser's words and images", browser.browser, browser.browser_seeds, 4096, 0.01),
    "mjpeg": Target("images in a server's stream", inputs.mjpeg, inputs.mjpeg_seeds, 8192, 0.01),
    "rig": Target("rig.yaml", inputs.rig, inputs.rig_seeds, 4096, 0.005),
    "rigfiles": Target("calibrations of other programs", rig_files.rig_files, rig_files.rig_files_seeds, 8192, 0.005),
    "settings": Target("settings files", inputs.settings, inputs.settings_seeds, 2048, 0.005),
    "recording": Target("recordings", inputs.recordings, inputs.recordings_seeds, 16_384, 0.005),
    "peers": Target("lists of peers", inputs.peers, inputs.peers_seeds, 2048, 0.005),
}
