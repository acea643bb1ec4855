"""Shell commands that put two virtual Bluetooth adapters of one guest on the air."""

AIR = """
modprobe -a hci_vhci rfcomm
ready() { [ "$(hciconfig | grep -c 'BD Address: 00:AA:01')" = 2 ]; }
until ready; do # on a busy machine the kernel may give an adapter up that did not answer in 10 s, and bluetoothd never sees that one
    kill $(pidof btvirt) 2>/dev/null
    (setsid btvirt -l2 >/srv/btvirt.log 2>&1 &)
    for _ in $(seq 75); do ready && break; sleep 0.2; done
done
"""
"""The adapters, not switched on."""

DAEMON = """
systemctl unmask bluetooth && systemctl start bluetooth
for h in hci0 hci1; do for name in Powered Discoverable; do
    until busctl set-property org.bluez /org/bluez/$h org.bluez.Adapter1 $name b true; do sleep 0.2; done
done; done 2>/dev/null
"""
"""The daemon switches adapters on: it refuses one that another program has, and does not notice what hciconfig does."""

SWITCH_ON = "for h in hci0 hci1; do until hciconfig $h up && hciconfig $h piscan; do sleep 0.2; done; done 2>/dev/null"
"""The same without a daemon; after this the adapters can be found and dialled."""
