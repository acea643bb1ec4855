"""board-agent run: serve frames until stopped."""

import argparse
import json
import logging
import os
import sys
from collections.abc import Mapping
from contextlib import ExitStack, closing
from typing import Final

from board_agent.agent import Agent, Service, Summary
from board_agent.await_camera import wait_for_camera
from board_agent.rate_control import RateControl, ladder, ways
from board_agent.sd_notify import Notifier
from board_agent.settings import BoardSettings, check, key_folder, resolve_settings
from board_agent.status import StatusLine
from common import now
from common.camera.base import CameraHealth, health_values
from common.camera.factory import open_camera
from common.camera.options import EXAMPLE
from common.errors import SettingsError
from common.link.factory import open_links, parse_link, tell_insecure
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.settings import log_level
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.protocol.message import BoardCounts
from common.stamp import board_clock
from common.words import counted

_LOG: Final = logging.getLogger("board_agent")


def run(options: argparse.Namespace) -> int:
    """Serve until stopped, then print what became of the frames."""
    settings = resolve_settings(options).values
    check(settings)
    logs.set_up(log_level(settings.log_level))
    if not settings.camera:
        raise SettingsError("no camera is given", f"use --camera {EXAMPLE}")
    signals = StopSignals()
    summary = _serve(settings, signals)
    session, counts = summary.session, {"grabbed": summary.counts.grabbed, "sent": summary.counts.sent}
    dropped = {reason.value: count for reason, count in summary.counts.dropped}
    camera = health_values(summary.camera)
    drops_told = {f"dropped_{reason}": count for reason, count in dropped.items()}
    _LOG.info(
        logs.event("stopped", session=session, **counts, **drops_told, garbage=summary.garbage, **_troubles(camera))
    )
    if options.json:
        values = {"session": session, **counts, "dropped": dropped, "garbage": summary.garbage}
        print(json.dumps({**values, "ended": summary.ended, "camera": camera}))
    else:
        drops = "".join(f", {count} {reason}" for reason, count in dropped.items()) or ", none dropped"
        account = f"session {session}: {counted(counts['grabbed'], 'frame')} grabbed, {counts['sent']} sent{drops}"
        print(fitted(account, sys.stderr), file=sys.stderr)
    return INTERRUPTED if signals.interrupted else 0


def _troubles(camera: Mapping[str, object]) -> dict[str, object]:
    """Return what went wrong with the camera as plain fields, for one line of the log."""
    plain = {f"camera_{key}": value for key, value in camera.items() if isinstance(value, int | str) and value}
    faults = camera["faults"]
    return plain | ({f"spoiled_{key}": count for key, count in faults.items()} if isinstance(faults, dict) else {})


def _serve(settings: BoardSettings, signals: StopSignals) -> Summary:
    """Open the camera, then the links; serve; close everything again."""
    boot_id, session = now.boot_id(), now.random_id()
    clock, uris = board_clock(boot_id), [parse_link(uri, listens_by_default=True) for uri in settings.link]
    with ExitStack() as opened:
        notifier = opened.enter_context(closing(Notifier(os.environ)))
        if settings.wait_for_camera:
            camera = wait_for_camera(settings.camera, clock, signals.reader, notifier)
        else:
            camera = open_camera(settings.camera, clock, now.monotonic_ns())
        if camera is None:
            return Summary(session=session, counts=BoardCounts(), garbage=0, ended=False, camera=CameraHealth())
        opened.enter_context(closing(camera))
        for uri in uris:
            tell_insecure(uri)
        keys = key_folder(settings.keys)
        links = [opened.enter_context(closing(link)) for link in open_links(uris, keys, board=True)]
        _LOG.info(logs.event("serving", session=session, camera=settings.camera, links=",".join(settings.link)))
        idle_ns = round(settings.idle_after * 1e9) or None
        status = StatusLine(settings.camera, camera.description.pacing, settings.link, now.monotonic_ns())
        modes = ladder(camera.offers, ways(settings.adapt), settings.least_fps)
        control = RateControl(modes) if len(modes) > 1 else None
        service = Service(notifier, status)
        summary = Agent(
            camera, links, session, boot_id, signals.reader, service=service, idle_ns=idle_ns, control=control
        ).run()
        notifier.stopping("stopped")
        return summary
