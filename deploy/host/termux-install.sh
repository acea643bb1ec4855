#!/bin/sh
# Installs phone-host in Termux on an Android phone, or updates it: `sh deploy/host/termux-install.sh`. Nobody needs root.
# Termux's own packages where PyPI has none for Android; the pinned packages of requirements/run.txt in .venv; then this project, whose
# native library clang builds. Run it again to update: after `git pull`, after `pkg upgrade`, or with another choice.
#   --no-compiler   does without clang: OpenCV's matcher computes depth then, six times the work for each pair
#   --service       serves the page always, and after the phone's start if the app Termux:Boot is there
#   --no-service    ends that
set -eu
cd "$(dirname "$0")/../.."
root=$(pwd)
log=$root/build/termux-install.log
venv=$root/.venv

fail() { # PROBLEM REMEDY: one line, exit 3
    echo "error: $1: $2" >&2
    exit 3
}

quietly() { # PROBLEM REMEDY COMMAND...: its output goes to the log
    problem=$1 remedy=$2
    shift 2
    "$@" >>"$log" 2>&1 </dev/null || fail "$problem (see $log)" "$remedy"
}

compiler=clang service=
for option in "$@"; do
    case $option in
    --no-compiler) compiler= ;;
    --service) service=yes ;;
    --no-service) service=no ;;
    -h | --help) sed -n '2,/^set/s/^# \{0,1\}//p' "$0"; exit ;;
    *) echo "error: $option is no option: give --no-compiler, --service or --no-service" >&2; exit 2 ;;
    esac
done

if [ -z "${PREFIX-}" ] || ! command -v pkg >/dev/null; then
    fail "this is not Termux" "on a laptop: make run-venv"
fi
case $(uname -m) in
aarch64 | x86_64) ;;
*) fail "this phone is a 32-bit one ($(uname -m))" "use a 64-bit phone: PyPI has no pyzmq for others" ;;
esac
mkdir -p "$(dirname "$log")"
: >"$log"

repair="run termux-change-repo and pkg upgrade, then this script again"
echo "Termux's packages (some minutes when new) ..."
quietly "pkg cannot install x11-repo, where OpenCV is" "$repair" pkg install -y x11-repo
quietly "pkg cannot read the lists of packages" "$repair" pkg update
# shellcheck disable=SC2086  # no compiler: no word
quietly "pkg cannot install the packages" "$repair" pkg install -y -o Dpkg::Options::=--force-confold \
    python python-pip python-numpy python-msgpack python-cryptography opencv-python $compiler

# An environment of another Python, as `pkg upgrade` leaves it, holds packages that this one cannot load.
version=$(python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
if [ "$(sed -n 's/^version *= *\([0-9]*\.[0-9]*\).*/\1/p' "$venv/pyvenv.cfg" 2>/dev/null)" != "$version" ]; then
    rm -rf "$venv"
    quietly "Python cannot make an environment in $venv" "make room" python -m venv --system-site-packages --without-pip "$venv"
fi
pip() { # what pip would ask or announce is of no use here
    PIP_DISABLE_PIP_VERSION_CHECK=1 "$venv/bin/python" -m pip --no-input install -q "$@"
}
echo "Python $version: the pinned packages ..."
quietly "pip cannot install requirements/run.txt" "check the network, then run this script again" \
    pip --require-hashes --only-binary :all: -r requirements/run.txt
echo "tandemscan and its native library (a minute or two) ..."
quietly "tandemscan cannot be installed" "git status shows what was changed here" pip --no-deps --no-build-isolation -e .

for module in numpy cv2 zmq msgpack aiohttp cryptography; do
    quietly "$module cannot be loaded" "run pkg upgrade, then this script again: Termux's packages must fit each other" \
        "$venv/bin/python" -c "import $module"
done
if [ ! -e "$PREFIX/bin/phone-host" ] || [ -L "$PREFIX/bin/phone-host" ]; then
    ln -sf "$venv/bin/phone-host" "$PREFIX/bin/phone-host"
fi

# The page as a service (termux-services is runit): it holds the wake lock while it runs.
page=$PREFIX/var/service/phone-host-page
boot=$HOME/.termux/boot/tandemscan
script() { # FILE: an executable script from stdin
    mkdir -p "$(dirname "$1")"
    { echo "#!$PREFIX/bin/sh"; cat; } >"$1.new"
    chmod 755 "$1.new"
    mv "$1.new" "$1"
}
if [ "$service" = yes ]; then
    quietly "pkg cannot install termux-services" "$repair" pkg install -y termux-services
    script "$page/run" <<END
exec 2>&1
termux-wake-lock
exec "$venv/bin/phone-host" serve
END
    echo termux-wake-unlock | script "$page/finish"
    mkdir -p "$page/log"
    ln -sf "$PREFIX/share/termux-services/svlogger" "$page/log/run"
    script "$boot" <<END
termux-wake-lock
. "$PREFIX/etc/profile.d/start-services.sh"
END
    # shellcheck disable=SC1091  # Termux's own
    . "$PREFIX/etc/profile.d/start-services.sh"
elif [ "$service" = no ] && [ -e "$page" ]; then
    SVDIR=$PREFIX/var/service sv down phone-host-page >>"$log" 2>&1 || true
    rm -rf "$page" "$boot"
fi
if [ -e "$page/run" ]; then
    export SVDIR="$PREFIX/var/service"
    service_log=$PREFIX/var/log/sv/phone-host-page/current
    if sv status phone-host-page 2>/dev/null | grep -q '^run:'; then # with the new code
        quietly "the service does not start again" "look into $service_log" sv -w 25 restart phone-host-page
    fi
    if [ "$service" = yes ]; then
        seconds=0 # runsvdir looks for new services every 5 s
        until [ -e "$page/supervise/ok" ]; do
            [ $((seconds += 1)) -le 15 ] || fail "termux-services does not run" "type exit, open Termux again, then run this script again"
            sleep 1
        done
        quietly "the service does not start" "look into $service_log" sv-enable phone-host-page
        echo "For its start with the phone, install Termux:Boot from where Termux came from, and open that app once."
    fi
fi
echo "Installed. Next: phone-host doctor, then sh deploy/host/termux-run.sh"
