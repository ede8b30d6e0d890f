"""Text of the window and of the live page."""

from bench.events import State

TITLE = "rocking-bench"
PAGES = ("Setup", "Protocol", "Queue", "Run", "Results")

WORDS = {
    State.IDLE: "IDLE",
    State.ARMED: "ARMED",
    State.RUNNING: "RUNNING",
    State.WAITING: "WAITING",
    State.STOPPING: "STOPPING",
    State.ABORTING: "ABORTING",
    State.HALTED: "HALTED",
    State.CLOSED: "CLOSED",
}
NO_SESSION, STARTING, PLANNING, NO_LINK = "NO RUN", "STARTING", "PLANNING", "NO LINK"
NO_SESSION_WHY = "no run has been started in this window; choose a protocol"
NO_RUN_HERE = "no run is under way on this computer"
RUN_ELSEWHERE, ATTACHING = "RUN ELSEWHERE", "ATTACHING"
ELSEWHERE = "a run is under way on this computer: {run}; attach to watch it; STOP ends it"
ATTACHING_WHY = "waiting for the session: {run}"
PLANNING_LATE = "no message for {age:.0f} s: the computer may be busy; nothing is armed"
ATTACHED_RUN = "{owner}'s run: {run}."
ATTACHED_READ_ONLY = "STOP works here; {owner} answers questions and controls the ramp-out."
ATTACHED_CONTROLS = "Its window was lost; answer its questions in this window."
OWNERS = {"window": "another window", "terminal": "a terminal"}
UNNAMED = "operator at the window"
OWN_RUN = "This window's run: {run}."
ATTACH, ATTACH_TIP = "Attach", "Shows the run that is under way on this computer; STOP then stops it (Ctrl+Shift+A)."
DETACH, DETACH_TIP = "Detach", "Detaches this window from the run, which continues (Ctrl+Shift+A)."
STARTING_WHY = "starting the session process"
NO_LINK_WHY = (
    "no message from the bench for {age:.1f} s: its state is unknown. If the table moves, press the emergency stop."
)
GUARD = (
    "This STOP is a request to the software, not an emergency stop. The emergency stop is the red button at the bench."
)

STOP, STOP_NAME = "STOP\nF12", "STOP"
STOP_AGAIN = "STOP\nagain: CUT"
STOP_BY_MOUSE = "STOP\nby mouse"
KEY_NEEDS_FOCUS = "F12 works only while this window has the focus: click on it."
STOP_TIP = (
    "Ramps the output quickly to zero and ends the run (F12; the bar says when the key needs the focus). If pressed "
    "again after {after:g} s or more, cuts the enable line."
)
LATCHED = "STOP was pressed: clear it first"
STOPPED = "STOP was pressed"
CLEAR = "Clear STOP"
CLEAR_TIP = "Allows a new run (Ctrl+Shift+K). The stopped run is not resumed."
CLEAR_BUSY = "The stopped run is still under way."

ELAPSED, REMAINING, OWNER, STEP, INPUTS = "elapsed", "remaining", "run", "step", "safety inputs"
NO_INPUTS = "none configured"
INPUT_GOOD, INPUT_OPEN, INPUT_UNKNOWN = "good", "OPEN", "unknown"
INPUTS_UNREAD = "not read outside a run"
INPUTS_TIP = (
    "Configured inputs, such as auxiliary contacts of the emergency stop, over-travel switches or amplifier. They are "
    "read twice a second during a run, and shown as unknown after {stale:g} s without a reading."
)

CHECK = "Check the plan"
CHECK_TIP = "Computes the complete run in advance: prediction, margin to every limit, duration and disk space (Ctrl+K)."
CHECKING = "Computing the plan …"
START = "Start"
START_TIP = "Starts the run (Ctrl+Return)."
START_BUSY = "a run is under way"
START_ELSEWHERE = "another program is driving a real bench on this computer: attach to its run"
START_UNCHECKED = "check the plan first"
START_BAD = "a value is invalid: see the form"
START_REFUSED = "the plan was refused"
REALTIME, REALTIME_TIP = "&Real time", "Runs the simulated bench in real time instead of as fast as possible."
ASK, ASK_TIP = "Ask me", "Asks you to confirm operator tasks even if the simulated bench can perform them."
ASK_REAL_TIP = (
    "Every question waits for your answer. If unchecked, the run is unattended: every question is answered yes, as "
    "with --yes. Uncheck only for runs without operator tasks."
)
UNATTENDED = "Unattended: every question of this run is answered yes. Complete all operator tasks before the start."
GO_ON = "Continue without this window"
GO_ON_TIP = (
    "Without this option, a run ramps out when its window is closed, freezes or crashes; with it, the run continues "
    "to its end."
)
FOLDER, OPERATOR = "Results in", "Operator"
NOTE, NOTE_TIP = "Note", "Free text; stored in the data file."
FOLDER_TIP = "Folder for the results, created if missing. Existing results are never overwritten."
OPERATOR_TIP = "Name of the operator; stored in the data file."
DEFAULT_TIP = "If empty: {default}."
MARGINS = ("quantity", "unit", "demand", "at 95 %", "limit", "margin at 95 % [%]", "where")
MARGIN_TIP = (
    "Margin {margin:.1f} % for the nominal specimen, and at least {likely:.1f} % with a probability of 95 %, given the "
    "uncertainty of the specimen's parameters."
)
TIME_AND_DISK = "Expected duration {duration}. Disk: up to {needed:.0f} MB needed, {free:.0f} MB free."
TIGHTEST = "Tightest margin: {name}, limited by {owner}."
MAY_RUN, MAY_NOT = "The plan is within all limits.", "Refused: {why}"
NO_MARGINS = "This protocol does not predict margins."

DONE, DECLINE = "Done, continue", "End the run"
DONE_KEY, DECLINE_KEY = "Ctrl+Shift+Return", "Ctrl+Shift+Backspace"
DONE_TIP = "Confirms that the task is done and continues the run (Ctrl+Shift+Return)."
DECLINE_TIP = "Reports that the task is not done and ends the run (Ctrl+Shift+Backspace)."
PROMPT = "Operator task"
PROMPT_PARTS = ("Why", "Checked afterwards")
LEAVE_WINDOW, STAY = "Close the window", "Stay"
LEAVE_RAMPS_OUT = "This window controls a run. If you close the window, the output ramps out and the run ends."
LEAVE_GOES_ON = "A run is under way. It continues without this window; a window opened later can stop it."

RAMP_OUT = "Ramp out, keep data"
RAMP_OUT_TIP = "Ends the run gently: the output ramps out and the data are kept (Ctrl+E)."
TRACES = (
    ("drive", "V", 1.0),
    ("table acceleration", "m/s²", 1.0),
    ("storey 1, u1", "mm", 1e3),
    ("storey 2, u2", "mm", 1e3),
    ("drift, u2 − u1", "mm", 1e3),
)
"""Label, displayed unit, and displayed units per SI unit for each trace."""
SECONDS = "seconds before now"
ALPHA, PREDICTED, DIFFERENCE = "α₂", "predicted", "difference {off}"
TWIN = "live model"
MODULATED = "hollow: modulated motion"
OTHER_AXIS = "{name}: not drawn; it needs another axis"
BARE_SINE, BARE_RECORD = "ω = {omega:g} rad/s, bare frame", "{record}, bare frame"
MEASURING, LAST_POINT = "measuring {point}", "last point, {status}: {point}"
BAND = "Shaded: band due to the uncertainty of the specimen's parameters (k = 2), where the motion is stable."
BETA_AXIS = "stiffness ratio β [1]"
OMEGA_AXIS, GAIN_AXIS = "circular frequency ω [rad/s]", "gain α₂ [1]"
NO_GAIN, NO_RESULT, NO_GAIN_OF = "no gain yet", "no result yet", "no gain: {status}"
STEADY, SETTLING, GATHERING = "steady", "settling", "{done} of {needed} cycles"
REPEATS = "repeats every {cycles} cycles"
CHANGE = "{change:.2g} %"
SO_FAR = "{seconds:.1f} s of {record}"
NO_CHANGE = "< 0.01 %"
SENSORS = ("table acceler.", "table displ.", "laser 1", "laser 2")
STEADY_TIP = (
    "For each sensor, the mean cycles of two windows of {window} cycles are compared; steady means that they agree "
    "within a third of {tolerance:g} % (settle tolerance) and that the cycles of the second window scatter by at most "
    "five times this tolerance.\n"
    "○ too few cycles, ◐ settling, ● steady, ◆ cycles that differ but repeat as a group; the number is the change "
    "between the two windows.\n"
    "Computed from the displayed traces, for information: the run ends a dwell by the same criterion, applied to the "
    "samples of all sensors together."
)
LOST_PARTS, AND = ("{n} event(s)", "{n} block(s) of traces"), " and "
LOST = "Not shown: {what}; the file contains all of them."
TRACES_OLD = "Traces and picture are not live: the newest sample is {age} old."
DATA_AGE = "newest sample {age:.1f} s old"
FRAME = "Bare frame: measured"
FRAME_ONLY = "Frame: measured. Block (dashed): angle unknown"
BLOCK_BY_LASER = "Storey 1: measured. Block: measured by laser 2, {height:.0f} mm above the table. Storey 2: unknown"
NOT_LIVE = "not live for {age:.0f} s"
NOT_LIVE_AXIS = "seconds before the newest sample, " + NOT_LIVE
ON_BLOCK = {
    "storey 2, u2": "laser 2, block {height:.0f} mm above the table",
    "drift, u2 − u1": "laser 2 − laser 1, not the drift",
}
"""Labels, by the usual label, of the traces that depend on laser 2, used while laser 2 measures the block."""
FRAME_AND_BLOCK = "Frame: measured. Block: model, driven by the measured table motion"
FACTOR = "magnification"
FACTOR_TIP = "Magnification of the motion; also with the mouse wheel, or the keys + and −, on the picture."

OPEN, OPEN_TIP = "Open a file …", "Opens the data file (campaign.h5) of a run (Ctrl+O)."
OPENING = "reading {path} …"
FILE_SUMMARY = "{path}\n{start}, {status}: {summary} ({length} of samples)"
RUN_FILES = "campaign (*.h5)"
CONFIGURATION_FILES, SPECIMEN_FILES = "configuration (*.toml)", "specimen (*.json)"
REMOVE, REMOVE_TIP = "Close file", "Removes the selected file from this page; it is not deleted."
PATH, FILES = "or type a path and press Enter", "open files"
FILES_TIP = "The selected file is shown. Ticked files are drawn together; the first ticked file is the reference."
GAINS, POINTS, COMPARISON, SAMPLES, FIGURE = "Points", "points", "Comparison", "Samples", "Figure"
NO_FIGURE, FIGURE_READING = "The run wrote no figure.", "reading the figures …"
POINT_TITLES = ("point", "quantity", "measured ± U", "predicted ± U", "difference", "verdict")
POINT_TIPS = (
    "point of the campaign",
    'measured quantity; "All fields" shows every field of the file',
    "measured value and expanded uncertainty (k = 2)",
    "predicted or nominal value; its expanded uncertainty (k = 2), or the interval expected for the measured value",
    "measured minus predicted",
    "agrees: the difference is within the combined uncertainty, or the measured value is within the predicted interval",
)
INTERVAL = "{value} ({low:.3g} to {high:.3g})"
AGREES, DISAGREES = "✓ agrees", "▲ DISAGREES"
AGREEING, AT, AND_MORE = "{agree} of {judged} compared results agree with the prediction", "at", "; {n} more"
YES, NO = "yes", "no"
THEME, THEME_TIP = "Colours", "Colours of the window; kept for the next start."
THEMES = {"desktop": "as the desktop", "light": "light", "dark": "dark"}
EVERYTHING, EVERYTHING_TIP = "All fields", "Shows every field of every point, with its unit (Ctrl+Shift+F)."
COMPARISON_TIP = "Tick two or more files to compare their points with those of the first."
DIFFERENCES = ("run", "point", "α₂, reference", "α₂", "difference", "uncertainty", "Eₙ", "verdict")
DIFFERENCE_TIPS = (
    "the compared run",
    "point at which the gain was measured",
    "gain in the first ticked file",
    "gain in this run",
    "this run minus the reference",
    "expanded uncertainty (k = 2) of the difference: root sum of squares of the two uncertainties, assumed independent",
    "|difference| / uncertainty (ISO 13528)",
    "within: Eₙ is at most 1",
)
RECORD_POINT, SINE_POINT = "{record}, β = {beta:g}", "ω = {omega:g} rad/s, β = {beta:g}"
WITHIN, BEYOND = "within", "▲ BEYOND"
RUN, CHANNEL, WHOLE = "run", "channel", "Whole run"
RUN_ITEM = "run {number}, {seconds:.0f} s"
SINCE_ARMED = "seconds since the rig was armed"
REPORT, EXPORT = "Create report", "Export"
REPORT_TIP = (
    "Runs `rockbench report` on the selected file at low priority, also during a run, and writes to the same folder."
)
EXPORT_TIP = "Runs `rockbench export` on the selected file and writes to a new folder next to it."
MAKING, MADE, NOT_MADE = "Creating {path} …", "Created: {path}", "No file was written. {text}"
OPEN_MADE = "Open"
RESULTS_EMPTY = "No file is open. The results of a run appear here when it has ended."
ENDED = "Run {status}: {reason}. Results are in {out}."
REFUSED = "Nothing was started. {text}"
FAILED_WORD = "FAILED"
FAILED = (
    "The session failed: {text}. Its file contains the data measured until then. Look at the bench: if "
    "the table moves, press the emergency stop."
)
RUN_TITLES = ("", "protocol", "status", "result", "specimen", "operator", "date", "folder")
RUN_TITLE_TIPS = (
    "Tick a run to draw it together with the other ticked ones and to compare it with the reference.",
    "protocol",
    'status of the run; "running": its file is being written',
    "main result, with expanded uncertainty (k = 2) and agreement with the prediction",
    'width and height of the block, stiffness of the first storey; "identified": from a specimen file',
    "operator",
    "start of the run",
    "folder of the results",
)
RUN_FOREIGN, RUN_DAMAGED, RUN_FILE = "not a run", "damaged", "the file"
RUN_GOING, RUN_GOING_WHY = "running", "its file is being written"
RUN_CUT = "not closed"
RUN_CUT_WHY = "its writer was killed or has stopped writing; `rockbench file recover` writes a clean file"
RUN_PASSED, RUN_NOT_PASSED = "✓ passed", "▲ NOT PASSED"
RUN_RANGE = "{name} {low} to {high}{unit}, {n} values"
RUN_AGREEING = "{agree} of {judged} agree"
RUN_SPECIMEN = "{how}, {b:.3g} × {h:.3g} mm, k₁ {k:.4g} N/m"
RUN_IDENTIFIED, RUN_ASSUMED = "identified", "assumed"
RUNS, RUNS_SEARCH = "runs", "search: protocol, result, operator, date, folder, …"
RUNS_SEARCH_TIP = "Shows only the runs with all of these words in any column or tooltip (Ctrl+F)."
RUNS_OPEN, RUNS_OPEN_TIP = "Open", "Opens the selected run (Enter or double click)."
RUNS_AGAINST = "Compare against"
RUNS_AGAINST_TIP = "Makes the selected run the reference of the comparison (Ctrl+Shift+B)."
RUNS_FOLDER, RUNS_FOLDER_TIP = "Folder …", "Shows the runs in another folder and in the folders below it."
RUNS_BACK, RUNS_BACK_TIP = "Opened run", "Returns to the opened run (Ctrl+B)."
RUNS_ALL, RUNS_ALL_TIP = "All runs", "Shows the list of all runs (Ctrl+B)."
RUNS_COUNT = "{shown} of {all} files in {folder}"
RUNS_REFERENCE = "reference: {name}, compared: {n}"
RUNS_READING = "reading {n}"
RUNS_NONE = "No data file in {folder}."
RUNS_NO_FOLDER = "{folder} does not exist yet: the first run creates it."
RUNS_UNREAD = "▲ {folder} cannot be read: {why}"
USE, USE_CHOICE, USE_ITEM = "Use for the next run", "results for other runs", "{kind} ({name})"
USE_TIP = (
    "Uses this result instead of the configured one for all following runs, including those of the queue; the Setup "
    "page shows the values (Ctrl+U). The configuration's file is not changed."
)
USE_BACK = "Configured values"
USE_BACK_TIP = "Uses the values of the configuration again for all following runs (Ctrl+Shift+U)."
USED = 'Runs now use {files}. "Configured values" undoes this.'
FURTHER, FURTHER_TIP = "and …", "Adds channels: in the plot of the first channel or, for another unit, below it."
OVERLAY, OVERLAY_TIP = "ticked runs", "Also draws the same channels and the same run of the other ticked files."
CURSORS = "cursors"
CURSORS_TIP = (
    "Shows two cursors, A and B, to drag; the line below gives the samples at both. While the plot has the focus, the "
    "keys A and B select a cursor, ← and → move it by one sample, with Shift by ten, Home and End to the first and the "
    "last visible sample."
)
PROBLEM = "{of}: {why}"
SPECTRUM = "spectrum"
SPECTRUM_TIP = (
    "Amplitude spectrum of all samples in the visible range (Hann window, mean removed): the line of a sine has the "
    "height of its amplitude. Missing samples are interpolated."
)
SPECTRUM_AXIS, AMPLITUDE = "frequency [Hz]", "amplitude"
SPECTRUM_LONG = "a spectrum of the visible range takes too long: zoom in to at most {most:.0f} s"
SPECTRUM_SHORT = "a spectrum needs at least {least} samples: zoom out"
CURSOR_TIMES = "A {a:.4f} s, B {b:.4f} s, B − A {step:+.4f} s ({rate} Hz)"
CURSOR_VALUES = "{name}: A {a}, B {b}, B − A {step} {unit}"
SCORE, SCORES, SCORE_AXIS = "Eₙ", "normalised errors", "row of the table of points"
SCORES_TIP = (
    "Eₙ = (measured − predicted) / combined expanded uncertainty (k = 2) of each compared result. Between the dashed "
    "lines at ±1, measurement and prediction agree."
)

WELCOME = (
    "Guided tour: this is the simulated bench; no hardware moves. The form contains one harmonic point, which runs as "
    "fast as the computer allows; tick Real time for the speed of a real bench (about four minutes)."
)
TOUR = (
    "Check the plan (Ctrl+K)",
    "Start (Ctrl+Return)",
    "Watch the gain converge to its prediction on the Run page",
    "Read the verdict on the Results page, then open Figure",
)
TOUR_SHOW, TOUR_SHOW_TIP = "Show me", "Opens the page of the current step; the control to be used is framed."
TOUR_COMPLETE = "The tour is complete. Change a value on the Protocol page, and check the plan again for your own test."
WELCOME_CLOSE = "Hide"
CONFIGURATION = "Configuration"
VIRTUAL_SHORT = "simulated bench"
VIRTUAL = "the simulated bench with the paper's specimen (no configuration file was given)"

OWN_ERROR = "error in the window, not in the bench: {error}. A run under way continues; details are in the terminal."


TROUBLE, TROUBLE_DETAILS, TROUBLE_CLOSE = "Needs attention", "Details", "Hide"
TROUBLE_PARTS = ("Event", "Reaction of the bench", "Next step")
TROUBLE_DETAILS_TIP = "Shows the full error message, for the developers (Ctrl+Shift+I)."
TROUBLE_CLOSE_TIP = "Hides this message; it stays in the log and in the data file (Ctrl+Shift+H)."
CONFIGURATION_TITLES = ("parameter", "value", "unit")
KEY_IN_FILE = "Key in the configuration file: `{key}`"
OPEN_CONFIGURATION = "Open a configuration …"
OPEN_CONFIGURATION_TIP = (
    "Opens another configuration file (TOML). If it is refused, the reason is shown and the current configuration "
    "stays in use (Ctrl+Shift+O)."
)
OPEN_SPECIMEN = "Open a specimen file …"
OPEN_SPECIMEN_TIP = (
    "Uses identified parameters of the specimen instead of the assumed ones, like --specimen (Ctrl+Shift+P)."
)
IDENTIFIED = "{kind}: {path}"
CONFIGURATION_KEPT = "{text}. The current configuration stays in use."
MUST_BE = "It must be {allowed}."
FIND = "Search for devices"
FIND_TIP = "Queries NI's driver or server and the serial ports, like `rockbench devices`; takes a few seconds (Ctrl+D)."
FIND_EMPTY = "No search with this configuration yet."
FIND_SIMULATED = "The simulated bench has no devices. You can still search for the devices of this computer."
FINDING = "Searching …"
FOUND = "Result of the last search."
FIND_FAILED = "The search for devices failed: {text}"
CHECK_LOOP = "Check the loop"
CHECK_LOOP_TIP = (
    "Records the signals at rest, then drives low-level sines with the frame locked to the table: checks polarity, "
    "scale and delay of the sensors, and the drive. Same as `rockbench check` (Ctrl+L)."
)
CHECK_LOOP_IDLE = "No check with this configuration yet."
CHECK_LOOP_RUNNING = "In progress; questions appear above."
CHECK_LOOP_ENDED = "{passed} passed, {failed} failed, {other} without verdict. {how}"
CHECK_IN = "Results are in {out}."
CHECK_CUT = "The check was not completed."
CHECK_TABLE_TIP = "The tooltip of a failed line gives the remedy."
ASK_CHECK_TIP = "On this bench, the frame is clamped and unclamped by hand, so the check always asks the operator."
CHECK_TITLES = ("verdict", "signal", "quantity", "measured", "U (k = 2)", "allowed")

DEFAULTS, DEFAULTS_TIP = "Defaults", "Fills the form with the defaults of the protocol."
LAST_VALUES = "Last values"
LAST_VALUES_TIP = (
    "Fills the form with the values of the last checked plan of this protocol, which may be from an earlier session."
)
LAST_VALUES_NONE = "No plan of this protocol has been checked yet."
LAST_VALUES_SHOWN = "Values of the last checked plan."
PRESET, PRESET_HINT = "Presets", "preset: select or name"
PRESET_TIP = "Select a preset to fill the form with it, or type a name to save the values of the form."
PRESET_SAVE, PRESET_SAVE_TIP = (
    "Save",
    "Saves the values of the form as the named preset. To replace a preset that was not loaded, press Save twice.",
)
PRESET_DELETE, PRESET_DELETE_TIP = "Delete", "Deletes the file of the named preset; the form keeps its values."
PRESET_LOADED, PRESET_SAVED, PRESET_DELETED = "Preset {name}.", "Saved: {path}", "Deleted: {name}"
PRESET_NO_NAME, PRESET_NONE = "type a name first", "there is no preset with this name"
PRESET_EXISTS = "A preset {name} exists; press Save again to replace it."
PRESET_INVALID = "Invalid values are marked in the form."
PRESET_UNKNOWN = "Ignored, because the protocol has no such parameter: {values}."
HELP, HELP_TIP = "?", "Help on the parameter whose field has the focus (F1)."
HELP_DEFAULT, HELP_USUAL = "Default: {default}.", "Usual: {low} to {high}{unit}; other values cause a notice."
HELP_TYPED = "Command line: `--{option}`. Protocol file: `{key}`."
HELP_PAGE = "Reference: {page}"
HELP_OPEN, HELP_OPEN_TIP = (
    "Open the page",
    "Opens the page of the documentation on this computer, in the default program of the desktop.",
)
HELP_CLOSE, HELP_CLOSE_TIP = "Close the help", "Shows the plan again."
SOUNDS = "Sounds"
SOUNDS_TIP = (
    "Beeps: one for a question, two for the end of a run, five for an abort or a failure. Kept for the next start."
)
RECENT, RECENT_TIP = "Recent configurations", "Opens a configuration that was used before."

ADD, ADD_TIP = "Add to queue", "Appends the checked plan to the queue (Ctrl+J)."
SAVE, SAVE_TIP = "Save in queue", "Replaces test {number} of the queue with the checked plan (Ctrl+J)."
LEAVE, LEAVE_TIP = "Discard changes", "Ends editing; the test in the queue stays unchanged (Esc)."
TAKE_IN = "Restore"
QUEUE_TIP = "Tests run from top to bottom. Enter opens a pending test in the form."
QUEUE_TITLES = ("", "state", "protocol", "parameters", "results in", "result or options")
STAGES = {
    "waiting": "○ waiting",
    "running": "● running",
    "done": "✓ done",
    "failed": "▲ failed",
    "skipped": "– skipped",
}
QUEUE_EMPTY = "The queue is empty: check a plan on the Protocol page, then add it."
QUEUE_STARTS, QUEUE_PAUSES = "Start the queue", "Pause after this test"
QUEUE_STARTS_TIP = "Runs the pending tests from top to bottom, each in a separate process (Ctrl+Shift+Q)."
QUEUE_PAUSES_TIP = "The current test runs to its end; no further test begins (Ctrl+Shift+Q)."
QUEUE_HOLDS = "the queue is running: pause it first"
QUEUE_IDLE, QUEUE_GOING, QUEUE_LAST = "{n} waiting.", "Running; {n} waiting.", "Pausing after this test; {n} waiting."
QUEUE_CHECKING = "Checking the plan of test {number}; {n} waiting."
QUEUE_PAUSED = "▲ Paused: {why} {n} waiting."
QUEUE_STOPPED = "STOP was pressed: use Clear STOP first."
QUEUE_ENDED = 'the status of test {number} is "{status}".'
QUEUE_REFUSED = "the plan of test {number} was refused."
QUEUE_FILE = "Saved in {path}; `rockbench queue` runs the same file."
QUEUE_UNKEPT = "Not saved: the queue is lost when this window closes."
QUEUE_OWNER = "the operator's window"
QUEUE_GONE = "The edited test has begun, or was skipped or removed, so it was not changed."
QUEUE_GONE_DID = "The queue is unchanged."
QUEUE_GONE_NOW = "The edited values are still on the Protocol page: check and add them, or edit the test again."
QUEUE_DID = "The queue is paused. The pending tests are unchanged in the file."
QUEUE_UNREAD_DID = "The file is unchanged. The queue of this window is empty and is not saved."
QUEUE_UNREAD_NOW = (
    "Correct the problem or move the file, then reopen the window; or specify another file with --queue FILE."
)
QUEUE_NOW = (
    "Free disk space or correct the permissions of the queue's file, or start the window with another file (--queue "
    "FILE)."
)
OPTIONS = {
    "realtime": "real time",
    "ask": "asks operator",
    "unattended": "unattended",
    "keep_going": "continues without the window",
}
POINT_WAITS, POINT_MEASURED, POINT_DONE = "waiting", "measuring", "done"
POINT_MARKS = {
    POINT_WAITS: ("○", "calm"),
    POINT_MEASURED: ("▶", "wait"),
    POINT_DONE: ("●", "good"),
    "modulated": ("◆", "wait"),
    "held": ("■", "wait"),
    "overturned": ("✕", "alarm"),
    "not played": ("–", "calm"),
    "not held": ("?", "wait"),
    "not measurable": ("?", "wait"),
}
"""Mark and level (colour) of a point, by its status; all other statuses have those of a finished point."""
EXPECTED = "≈ {time:%H:%M}"
METERS = {
    "displacement": "table displacement",
    "velocity": "table velocity",
    "acceleration": "table acceleration",
    "force": "force on the table",
    "current": "coil current",
    "heating": "coil heating",
    "laser_1": "laser 1 range used",
    "laser_2": "laser 2 range used",
    "drift": "drift",
}
MOTION_AXES = {
    "spectrum": ("frequency [Hz]", "drift [mm]"),
    "phase": ("drift [mm]", "drift velocity [mm/s]"),
    "Poincaré": ("drift [mm]", "drift velocity [mm/s]"),
}
"""Labels of the horizontal and the vertical axis."""
MOTION_NAMES = {
    "spectrum": "amplitude spectrum of the drift",
    "phase": "phase plane of the drift; grey: live model",
    "Poincaré": "Poincaré section of the drift, once per period of the sine",
}
TRACES_TAB = "traces"
LOG_FILTER, LOG_FILTER_TIP = "filter the log", "Shows only the lines that contain this text (Ctrl+Shift+L)."
NOTE_FIELD, NOTE_ADD = "add a note, press Enter", "Note"
NOTE_ADD_TIP = "Adds the text to the log and to the data file, with the bench time (Ctrl+Shift+N)."
NO_VALUE = "–"
TIME_TO_LIMIT = "limit in {seconds:.0f} s"
METER_TIP = (
    "{name}: {text} (largest magnitude in the last block, and limit). Line: peak of the run, {peak}. Triangle: "
    "planned value; 95 % of the specimens are predicted to stay below {planned}."
)
NAMES = {
    "meters": "meters of the limits",
    "matrix": "points of the campaign",
    "state": "state of the bench",
    "alpha": "running result",
    "live": "live view",
    "log": "event log",
    "queue": "queue",
    "picture": "picture of the specimen",
    "tour": "guided tour",
    "traces": "live traces",
    "protocol": "protocol",
    "history": "history",
    "details": "details",
    "devices": "devices",
    "margins": "margins",
    "check": "loop check",
    "configuration": "configuration",
    "steady": "steady state",
}
"""Accessible names of widgets without a label."""
LIVE_CHECK_TITLES = ("verdict", "line", "result")
LIVE_CHECK_MARKS = {
    "passed": ("✓", "passed", "good"),
    "failed": ("▲", "FAILED", "alarm"),
    "pending": ("…", "pending", "calm"),
    "other": ("·", "without verdict", "calm"),
}
"""Mark, word and level (colour) of a check line on the Run page, by its verdict."""
LIVE_CHECK_COUNT = "{n} {verdict}"
CLAMPED = {
    "table_locked": "Table clamped.",
    "frame_clamped": "Storeys clamped to the table.",
    "block_clamped": "Block clamped to the table.",
}
"""Text below the picture, by the field of `bench.app.display.status.Arrangement` that is True."""
FRAME_BY_LASERS = "Frame: measured"
LIVE_FAILED = "{error}. The run is not affected."
