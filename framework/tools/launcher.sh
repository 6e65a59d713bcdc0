#!/bin/sh
# perikit as packaged: starts the best build that this processor can run, or that for the level which PERIKIT_LEVEL names.
folder=${PERIKIT_LEVELS:-/usr/lib/perikit}
supported=$(/lib64/ld-linux-x86-64.so.2 --help | sed -n 's/^  \(x86-64-v[234]\) (supported.*/\1/p')
for level in ${PERIKIT_LEVEL:-native $supported}; do
  program=$folder/$level/bin/perikit
  [ -x "$program" ] && exec "$program" "$@"
done
echo "perikit: ${PERIKIT_LEVEL:+found PERIKIT_LEVEL=$PERIKIT_LEVEL; }this package has builds for $(ls "$folder" | tr '\n' ' ')and this processor can run $(echo $supported)" >&2
exit 1
