#!/usr/bin/env bash
# package_test.sh BUILD SCRATCH: Debian packages made, unpacked side by side, and tried.
set -euo pipefail
build=$1
scratch=$2
rm -rf "$scratch"
mkdir -p "$scratch/root"
cd "$build"
cpack -G DEB -B "$scratch" > "$scratch/cpack.log" 2>&1 || { cat "$scratch/cpack.log"; exit 1; }

for package in nacre nacre-rig nacre-presets nacre-blender libnacre-dev; do
  file=$(echo "$scratch/${package}"_*.deb)
  [ -f "$file" ] || { echo "no package $package" >&2; exit 1; }
  dpkg-deb --field "$file" Package Version Depends
  dpkg-deb --extract "$file" "$scratch/root"
done
dpkg-deb --field "$scratch"/nacre_*.deb Depends | grep -q libembree ||
  { echo "nacre doesn't say that it needs Embree" >&2; exit 1; }

root=$scratch/root/usr
export PATH=$root/bin:$PATH
nacre --version
nacre preset list --json --quiet | grep -q SVD_S10_Chess8x8
for file in nacre-factor.1.gz completions/nacre addons/nacre_blender/__init__.py rigs/gige-helios.toml \
  nacre/nacreConfig.cmake; do
  find "$root" -path "*/$file" | grep -q . || { echo "no $file in the packages" >&2; exit 1; }
done
if [ -f "$scratch"/python3-nacre_*.deb ]; then
  dpkg-deb --extract "$scratch"/python3-nacre_*.deb "$scratch/root"
  PYTHONPATH=$root/lib/python3/dist-packages /usr/bin/python3 -c 'import nacre; nacre.Dataset'
fi
cat > "$scratch/scene.xml" << 'XML'
<scene version="0.6.0"><integrator type="path"/>
<sensor type="perspective"><transform name="toWorld"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
<sampler type="sobol"><integer name="sampleCount" value="2"/></sampler>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
<emitter type="constant"/>
<shape type="sphere"><subsurface type="svd"><string name="material" value="SVD_S10_Chess8x8"/>
<float name="scale" value="20"/></subsurface><bsdf type="plastic"/></shape></scene>
XML
nacre render "$scratch/scene.xml" --out "$scratch/picture.exr" --quiet
nacre inspect "$scratch/picture.exr" > /dev/null
rm -rf "$scratch"
