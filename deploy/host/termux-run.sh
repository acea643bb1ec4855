#!/bin/sh
# Opens the page on this phone: `sh deploy/host/termux-run.sh [OPTIONS of phone-host serve]`. Serves it until Ctrl-C and keeps the phone
# awake meanwhile; if the service serves it already (termux-install.sh --service), opens that one.
set -eu
cd "$(dirname "$0")/../.."
program=$(pwd)/.venv/bin/phone-host
[ -x "$program" ] || { echo "error: phone-host is not installed here: run sh deploy/host/termux-install.sh" >&2; exit 3; }
command -v termux-wake-lock >/dev/null || { echo "error: this is not Termux: run phone-host serve --open" >&2; exit 3; }

patience=600 # s; the first start of an old phone takes a minute or more
log=$PREFIX/var/log/sv/phone-host-page/current
if [ $# = 0 ] && SVDIR=$PREFIX/var/service sv status phone-host-page 2>/dev/null | grep -q '^run:'; then
    seconds=0
    until url=$(sed -n 's/.*the page: \(http[^ ]*\).*/\1/p' "$log" 2>/dev/null | tail -n 1) && [ -n "$url" ]; do
        [ $seconds -lt "$patience" ] || { echo "error: the service has not said its address in $patience s: look into $log" >&2; exit 3; }
        [ $seconds != 0 ] || echo "The service starts ..."
        sleep 1
        seconds=$((seconds + 1))
    done
    exec termux-open-url "$url"
fi

termux-wake-lock
trap termux-wake-unlock EXIT
trap : INT # the program ends in order, then this script goes on
code=0
"$program" serve --open "$@" || code=$?
exit "$code"
