"""Control of the table: calibration, sine control, waveform replication, and preparation of records."""
