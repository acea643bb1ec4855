# shellcheck shell=sh
export SVDIR="$PREFIX/var/service"
export LOGDIR="$PREFIX/var/log"
echo "start-services" >>"$PREFIX/var/calls"
if [ ! -e "$PREFIX/var/runsvdir" ]; then
    : >"$PREFIX/var/runsvdir"
    (runsvdir "$SVDIR" >/dev/null 2>&1 &)
fi
