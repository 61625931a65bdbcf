# A bare Debian 12 in build/bare, made once, and a command to run in it; sourced from the top of the tree. As root, or with
# sudo.
sudo=$([ "$(id -u)" = 0 ] || echo sudo)
root=$PWD/build/bare/root

if [ ! -f "$root/made" ]; then
  command -v debootstrap >/dev/null || $sudo apt-get install -y -qq debootstrap >/dev/null
  echo "Making a bare Debian in build/bare/root"
  $sudo rm -rf "$root" && mkdir -p "$root"
  $sudo debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates bookworm "$root" >"$root.log"
  $sudo touch "$root/made"
fi
# What this machine needs to reach the registries.
for file in /etc/resolv.conf /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
  [ ! -f "$file" ] || $sudo cp -L "$file" "$root$file"
done
$sudo rm -rf "$root/test" && $sudo mkdir "$root/test"

inside() {
  $sudo env -i HOME=/root PATH=/usr/bin:/bin:/usr/sbin:/sbin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    chroot "$root" "$@"
}

# Packages of Debian, for a while: $1 is install or purge.
packages() {
  inside bash -c "{ [ $1 = purge ] || apt-get update -qq; } && apt-get $1 -y -qq --no-install-recommends ${*:2}" \
    >"$root.apt.log" 2>&1 || { tail -5 "$root.apt.log" >&2; exit 1; }
}
