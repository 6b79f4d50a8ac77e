"""The product: a rig run, recorded, modelled and diagnosed. It knows no device and no simulated rig; these come from
`drivers` and `hil` and are put together in `rig.app`. The modules right here are the ground floor: plain data and
protocols."""
