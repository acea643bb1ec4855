"""What board-agent's help shows: the examples of each verb, and what one can do next. Light: every start imports it."""

from typing import Final

NEXT_STEPS: Final = """board-agent streams this machine's camera to a phone or laptop, each frame with the moment of its exposure.

see which cameras are here, and what keeps them from streaming:
  board-agent cameras
  board-agent doctor

try it without a camera, with a folder of pictures; a host on this machine can then connect to tcp://127.0.0.1:5555:
  board-agent run --camera 'replay:frames?fps=30&loop=1'

stream a webcam to other machines:
  board-agent run --camera v4l2:auto --link 'tcp://*:5555'

let a new host in, while it runs (type the code on the host):
  sudo board-agent pair

every verb and its options:
  board-agent --help
  board-agent run --help
"""

GENERAL: Final = """examples:
  board-agent run --camera 'v4l2:/dev/video0?size=640x480&fps=30' --link 'tcp://*:5555'
  board-agent run --config /etc/tandemscan/board-agent.toml
  board-agent record --camera v4l2:auto --out walk.mcap
  board-agent cameras
  board-agent doctor
  sudo board-agent pair
  sudo board-agent keys --forget phone
"""

RUN: Final = """examples:
  board-agent run --camera 'v4l2:/dev/video0?size=640x480&fps=30' --link 'tcp://*:5555'
  board-agent run --camera 'replay:frames?fps=30&loop=1'
  board-agent run --camera 'replay:frames?pace=demand' --link ipc://$XDG_RUNTIME_DIR/board
  board-agent run --camera 'v4l2:auto?fps=30' --link 'rfcomm://*' --adapt quality,rate --least-fps 5
  board-agent run --config /etc/tandemscan/board-agent.toml
"""

RECORD: Final = """examples:
  board-agent record --camera v4l2:auto --out walk.mcap    # until Ctrl-C, or until nine tenths of the disk are full
  board-agent record --camera v4l2:auto --out drive.mcap --ring 2GB    # the newest 2 GB: drive-000001.mcap and so on
  board-agent record --camera 'replay:frames?fps=30' --seconds 60 --out minute.mcap
  board-agent record --config /etc/tandemscan/board-agent.toml --out walk.mcap --most 500MB
"""

SETTINGS: Final = """examples:
  board-agent settings
  board-agent settings --config /etc/tandemscan/board-agent.toml
  BOARD_AGENT_CAMERA=v4l2:auto board-agent settings --json
"""

CAMERAS: Final = """examples:
  board-agent cameras
  board-agent cameras --json
"""

DOCTOR: Final = """examples:
  board-agent doctor    # what the service would use, where it is installed
  board-agent doctor --camera v4l2:auto --link 'tcp://*:5555'
  board-agent doctor --config /etc/tandemscan/board-agent.toml --json
"""

KEYS: Final = """examples:
  sudo board-agent keys    # the service's keys, where it is installed
  board-agent keys    # your own
  sudo board-agent keys --forget phone
  sudo board-agent keys --new    # then pair with every host again
  sudo board-agent keys --add phone 'PUBLIC-KEY'    # as `phone-host keys` shows it
"""

PAIR: Final = """examples:
  sudo board-agent pair    # for the service
  board-agent pair --seconds 60    # for an agent that you started yourself
"""
