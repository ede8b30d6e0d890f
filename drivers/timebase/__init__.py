"""One time base: places sensors with clocks of their own on the sample clock."""
