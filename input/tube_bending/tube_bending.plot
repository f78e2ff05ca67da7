# The plastic moment of the half without hardening, and torque for force
--torque --curve 'fully plastic, not hardened' '0.830766e6'
