# shellcheck shell=sh
export SVDIR="$PREFIX/var/service"
export LOGDIR="$PREFIX/var/log"
echo "start-services" >>"$PREFIX/var/calls"
pid=$(cat "$PREFIX/var/runsvdir" 2>/dev/null) || pid=
if ! grep -q runsvdir "/proc/${pid:-none}/cmdline" 2>/dev/null; then # it may have ended with an earlier life of the phone
    (
        runsvdir "$SVDIR" >/dev/null 2>&1 &
        echo "$!" >"$PREFIX/var/runsvdir"
    )
fi
