#!/bin/sh
# The paper once more, by pamrig commands only: Table II settings, a Table III of ours, Table IV, BW beside MBW, Figs. 1 and 4 to 6,
# on the simulated rig and on a physics rig that shares no law with the models.
#   sh configs/reproduce_paper.sh [OUT] [UNIT of the physics rig]
set -eu
out=${1:-logs/paper_reproduction}
unit=${2:-1}
mkdir -p "$out"

# Fig. 1: the printed Bouc-Wen model at several frequencies
pamrig simulate paper_fig1 --model paper_fig1 -o "$out/fig1" --figure "$out/fig1.png"

# the paper's records, on both rigs
pamrig run paper --clock virtual --seed 1 --out "$out/simulated"
pamrig simulate paper --plant "$unit" -o "$out/physics"

for rig in simulated physics; do
  sine="$out/$rig/sine_0.5hz_0.20mpa.mcap"
  for input in command pressure; do
    for kind in mbw bw; do
      # Table II settings, the 0.5 Hz sine alone; the YAML and the JSON are our Table III
      pamrig identify "$sine" --kind $kind --input $input --mean-exponent 0 -o "$out/$rig-$input-$kind.yaml" --json "$out/$rig-$input-$kind.json"
    done
    # Table IV and Figs. 4 to 6
    pamrig validate "$out/$rig-$input-mbw.yaml" "$out/$rig" --beside "$out/$rig-$input-bw.yaml" \
      --figures "$out/$rig-$input" --json "$out/$rig-$input-table4.json"
  done
  # what three sines instead of one are worth
  pamrig identify "$out/$rig/sine_0.2hz_0.20mpa.mcap" "$sine" "$out/$rig/sine_0.8hz_0.20mpa.mcap" \
    --input command --mean-exponent 0 -o "$out/$rig-three.yaml" --json "$out/$rig-three.json"
  pamrig validate "$out/$rig-three.yaml" "$out/$rig" --json "$out/$rig-three-table4.json"
done
