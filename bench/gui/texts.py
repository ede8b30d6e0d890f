"""Every text of the window, in one place."""

from bench.events import State
from drivers.rig import Handwork

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
NO_SESSION, STARTING, NO_LINK = "NO RUN", "STARTING", "NO LINK"
NO_SESSION_WHY = "nothing is armed; choose a protocol"
STARTING_WHY = "the session's process is being started"
NO_LINK_WHY = (
    "nothing has been heard of the bench for {age:.1f} s: what it does is not known here. "
    "If the table moves, press the emergency stop."
)
GUARD = "This STOP asks the program. It is no emergency stop: that is the red button at the bench."

STOP, STOP_NAME = "STOP\nF12", "STOP"
STOP_AGAIN = "STOP\nagain: CUT"
STOP_TIP = (
    "Ramps the output out fast and ends the run (F12, from everywhere). Pressed again, {after:g} s later or more: cuts "
    "the enable line."
)
LATCHED = "STOP was pressed: clear it first"
CLEAR = "Clear STOP"
CLEAR_TIP = "Allows a new run. The run that was stopped is not resumed."

ELAPSED, REMAINING, STEP, INPUTS = "elapsed", "remaining", "step", "safety inputs"
NO_INPUTS = "none are wired"
INPUT_GOOD, INPUT_OPEN, INPUT_UNKNOWN = "good", "OPEN", "unknown"
INPUTS_UNREAD = "read while a run is under way"
INPUTS_TIP = (
    "Second contacts of emergency stop, over-travel switches and amplifier. Read twice a second during a run; older "
    "than {stale:g} s they are unknown."
)

CHECK = "Check the plan"
CHECK_TIP = "Computes the whole run beforehand: prediction, margin to every limit, time and disk (Ctrl+K)."
CHECKING = "The plan is being computed …"
START = "Start"
START_TIP = "Starts the run (Ctrl+Return)."
START_BUSY = "a run is under way"
START_UNCHECKED = "check the plan first"
START_BAD = "a value is refused: see the form"
START_REFUSED = "the plan is refused"
REALTIME, REALTIME_TIP = "&Real time", "Lets the simulated bench run at the pace of the clock, not as fast as it can."
ASK, ASK_TIP = "Ask me", "Ask for the hand work even where the bench does it by itself."
ASK_REAL_TIP = (
    "Every question waits for your answer. Unchecked, an unattended run: every question is answered with yes, as --yes "
    "does. Only where nothing is left to do by hand."
)
UNATTENDED = "Unattended: every question of this run is answered with yes. Leave nothing to do by hand."
GO_ON = "Go on without this window"
GO_ON_TIP = "A run whose window is closed, frozen or killed ramps out; with this it goes on to its end."
FOLDER, OPERATOR = "Results in", "Operator"
NOTE, NOTE_TIP = "Note", "Something to remember; kept in the data file."
FOLDER_TIP = "Folder for the results; made if missing. Results that are there already are never overwritten."
OPERATOR_TIP = "Who runs it; kept in the data file."
DEFAULT_TIP = "Left empty: {default}."
MARGINS = ("quantity", "unit", "demand", "at 95 %", "limit", "margin [%]", "where")
TIME_AND_DISK = "Expected duration {duration}. Disk: {needed:.0f} MB may be needed, {free:.0f} MB are free."
TIGHTEST = "Tightest: {name}, limited by {owner}."
MAY_RUN, MAY_NOT = "The plan is within every limit.", "Refused: {why}"
NO_MARGINS = "This protocol predicts no margins."

DONE, DECLINE = "Done, go on", "End the run"
DONE_KEY, DECLINE_KEY = "Ctrl+Shift+Return", "Ctrl+Shift+Backspace"
DONE_TIP = "It is done as asked: the run goes on (Ctrl+Shift+Return)."
DECLINE_TIP = "It is not done: the run ends here (Ctrl+Shift+Backspace)."
PROMPT = "The bench waits for you"
PROMPT_PARTS = ("Why", "Checked afterwards")
_AT_ZERO = "The output is at zero, the rig is stopped, and both stay so until you answer."
_ARMING = (
    "Every safety input before the rig is armed; then, at rest, that every sensor measures and the storeys are still. "
    "Only then may the table move."
)
_NOT_CHECKED = "No sensor sees whether it is done: look before you answer. {what}"
HANDWORK_UNKNOWN = (
    f"Only hands can do it. {_AT_ZERO}",
    "Every safety input whenever the rig is armed. Whether this is done no sensor sees: look before you answer.",
)
HANDWORK = {
    Handwork.MOUNT_SPRING: (f"The next points need this spring between frame and block. {_AT_ZERO}", _ARMING),
    Handwork.REMOVE_BLOCK: (f"The next test is of the bare frame. {_AT_ZERO}", _ARMING),
    Handwork.STAND_BLOCK_UP: (f"The block has fallen; no test begins until it stands. {_AT_ZERO}", _ARMING),
    Handwork.LOCK_FRAME: (
        f"The storeys have to move with the table, so that every sensor sees one motion. {_AT_ZERO}",
        _NOT_CHECKED.format(what="The table may move in what follows, clamped storeys with it."),
    ),
    Handwork.UNLOCK_FRAME: (
        f"The tests that follow need a frame that is free. {_AT_ZERO}",
        _NOT_CHECKED.format(what="The clamps off the storeys are checked by the next test at the earliest."),
    ),
    Handwork.HOLD_BLOCK: (
        f"The spring is measured against a block that cannot lift. {_AT_ZERO}",
        _NOT_CHECKED.format(what="A block that is not held shows in what is measured, and may fall."),
    ),
    Handwork.LOCK_TABLE: (
        f"What is let go by hand must not move the table. {_AT_ZERO} While the table is clamped it is not driven.",
        _NOT_CHECKED.format(what="What is recorded while it is clamped is recorded without drive."),
    ),
    Handwork.UNLOCK_TABLE: (
        f"The table has to be free before it is ever driven again. {_AT_ZERO}",
        _NOT_CHECKED.format(what="A table that is driven against its clamp overloads the shaker."),
    ),
    Handwork.WATCH_BLOCK: (
        f"Laser 2 measures how the block rocks. {_AT_ZERO}",
        "Every safety input before the rig is armed; then, at rest, that the laser measures. The guard does not watch "
        "the drift while the laser looks at the block. Nothing is driven.",
    ),
    Handwork.WATCH_STOREYS: (
        f"Laser 2 has to watch storey 2 again: the guard needs it for the drift. {_AT_ZERO}",
        _NOT_CHECKED.format(what="The next test takes its zero where the laser looks then."),
    ),
    Handwork.TILT_BLOCK: (
        f"The block starts from this tilt, without a push. {_AT_ZERO} They stay at zero while it is recorded.",
        "Every safety input before the rig is armed; afterwards, in the recording, that the block was let go and "
        "rocked. The table does not move.",
    ),
    Handwork.PULL_FRAME: (
        f"The frame starts from this displacement, without a push. {_AT_ZERO} They stay at zero while it is recorded.",
        "Every safety input before the rig is armed; afterwards, in the recording, that the frame was let go. The "
        "table does not move.",
    ),
}
"""Why a hand is needed and what is checked when it is done, for each kind of work."""

RAMP_OUT = "Ramp out and keep"
RAMP_OUT_TIP = "Ends the run gently: the output ramps out, what was measured is good (Ctrl+E)."
TRACES = (
    ("drive", "V", 1.0),
    ("table acceleration", "m/s²", 1.0),
    ("storey 1, u1", "mm", 1e3),
    ("storey 2, u2", "mm", 1e3),
    ("drift, u2 − u1", "mm", 1e3),
)
"""Label, unit on the screen, and screen units per SI unit, of each trace."""
SECONDS = "seconds before now"
ALPHA, PREDICTED = "gain α₂", "predicted"
TWIN = "model beside the test"
BAND = "Pale: what is left open of the specimen (k = 2), where the motion is stable."
BETA_AXIS = "stiffness ratio β [1]"
OMEGA_AXIS, GAIN_AXIS = "circular frequency ω [rad/s]", "gain α₂ [1]"
NO_GAIN = "no gain yet"
STEADY, SETTLING, GATHERING = "steady", "settling", "{done} of {needed} cycles"
REPEATS = "every {cycles} cycles alike"
CHANGE = "{change:.2g} %"
CYCLES, SO_FAR = "{cycles} cycles", "{seconds:.1f} s of {record}"
NO_CHANGE = "< 0.01 %"
SENSORS = ("table acceler.", "table displ.", "laser 1", "laser 2")
STEADY_TIP = (
    "Each sensor by itself: the means of its cycles in two windows of {window} cycles are compared, and steady means "
    "within a third of {tolerance:g} % (settle_tolerance). From the traces; the run judges the samples themselves."
)
LOST = "{events} events and {traces} blocks of traces were not shown: the file has them all."
DATA_AGE = "newest sample {age:.1f} s old"
FRAME = "Bare frame: measured"
FRAME_ONLY = "Frame: measured. Block (dashed): angle not known"
FRAME_AND_BLOCK = "Frame: measured. Block: model, on the measured table"
FACTOR = "motion drawn"
FACTOR_TIP = "How many times as large as the frame its motion is drawn: the wheel over the picture, or + and − there."

OPEN, OPEN_TIP = "Open a file …", "Opens the campaign.h5 of a run (Ctrl+O)."
OPEN_BESIDE = "{why}; a path can be typed at any time"
FILE_TOLD = "{path}\n{start}, {status}: {summary} ({length} of samples)"
RUN_FILES = "campaign (*.h5)"
CONFIGURATION_FILES, SPECIMEN_FILES = "configuration (*.toml)", "specimen (*.json)"
REMOVE, REMOVE_TIP = "Close file", "Takes the chosen file off this page; the file stays."
PATH, FILES = "or type a path, Enter", "open files"
FILES_TIP = "The chosen one is shown; those that are ticked are drawn together. The first of them is the reference."
GAINS, POINTS, COMPARISON, SAMPLES = "Gains", "points", "Comparison", "Samples"
COMPARISON_TIP = "Tick two files or more: the points of each against those of the first."
DIFFERENCES = ("run", "point", "α₂, reference", "α₂", "difference", "uncertainty", "E_n", "verdict")
DIFFERENCE_TIPS = (
    "the run that is compared",
    "where it was measured",
    "gain in the first file that is ticked",
    "gain in this run",
    "this run less the reference",
    "of the difference, expanded (k = 2): root of the sum of the squares of both, taken as independent",
    "|difference| over its uncertainty (ISO 13528)",
    "within: E_n is at most 1",
)
RECORD_POINT, SINE_POINT = "{record}, β = {beta:g}", "ω = {omega:g} rad/s, β = {beta:g}"
WITHIN, BEYOND = "within", "▲ BEYOND"
RUN, CHANNEL, WHOLE = "run", "channel", "Whole run"
RUN_ITEM = "{number} ({seconds:.1f} s)"
SINCE_ARMED = "seconds since the rig was armed"
REPORT, EXPORT = "Make a report", "Export"
REPORT_TIP = "`rockbench report` of the chosen file, beside it; goes on beside a run, with less priority."
EXPORT_TIP = "`rockbench export` of the chosen file, into a new folder beside it."
MAKING, MADE, NOT_MADE = "{path} is being made …", "Made: {path}", "Nothing was made. {text}"
OPEN_MADE = "Open it"
RESULTS_EMPTY = "No file is open. The results of a run appear here when it is over."
ENDED = "The run was {status}: {reason}. Results are in {out}."
REFUSED = "Nothing was started. {text}"
FAILED_WORD = "FAILED"
FAILED = (
    "The session failed: {text}. Its file holds what was measured until then. "
    "Look at the bench: if the table moves, press the emergency stop."
)

WELCOME = (
    "First minute: this is the virtual bench, nothing real moves. The form holds one harmonic point, run as fast as "
    "the machine can; tick Real time to see it as it is at the bench, in about four minutes."
)
TOUR = (
    "Check the plan (Ctrl+K)",
    "Start (Ctrl+Return)",
    "Watch the gain come to its prediction on the Run page",
    "See the file under Results",
)
WELCOME_CLOSE = "Hide"
CONFIGURATION = "Configuration"
VIRTUAL_SHORT = "simulated bench"
VIRTUAL = "the simulated bench with the paper's specimen (no configuration file was given)"

OWN_ERROR = "an error of the window, not of the bench: {error}. The run goes on; the terminal has the details."


TROUBLE, TROUBLE_DETAILS, TROUBLE_CLOSE = "Needs you", "Details", "Hide"
TROUBLE_PARTS = ("What happened", "What the bench did", "What to do now")
TROUBLE_DETAILS_TIP = "The whole message of the program, for whoever looks after it (Ctrl+Shift+I)."
TROUBLE_CLOSE_TIP = "Hides this message; the log and the file keep it (Ctrl+Shift+H)."
RUN_ENDED = "The run was {status}: {reason}."
DID = {
    "aborted": "The drive went to zero along the fast ramp, and the rig was stopped.",
    "halted": "The enable line was cut at once, without a ramp.",
    "failed": "The output was ramped to zero where the rig still answered, and cut where it did not.",
}
DID_NOTHING = "The table was not driven."
KEPT = "What was measured until then is in {out}."
DID_REFUSE = "Nothing was started, nothing was written, nothing was armed."
DID_NOT_START = "The rig was never armed; what had been opened was closed again."
DID_LOSE = (
    "The output is brought to zero whenever a session ends; when its process died, by watchdog and heartbeat where "
    "they are configured. What was recorded until then stays readable."
)
NOW_REFUSED = "Change the value that is named, then check the plan again."
NOW_LOOK = (
    "Look at the bench: if the table moves, press the emergency stop. Then run the loop check on the Setup page before "
    "the next test."
)
NOW_LIMIT = (
    "Look at specimen and sensors before the next test: {subject} was beyond its limit. If they are well, compare the "
    "margins of the plan, and ask for less motion."
)
_NOW_DEVICE = (
    "See to power and cables of what is named, then look for devices on the Setup page, and run the loop check."
)
_NOW_DISK = (
    "Free space on the disk, or name a folder on another one under Results in. `rockbench file check` says what the "
    "file holds."
)
NOW = {
    "request": "Clear STOP on the Protocol page when the bench is safe. A new run begins from its start.",
    "declined": "Do what was asked for, or take it out of the plan, then start anew.",
    "safety_input": (
        "See at the bench why it opened and reset it there; the header shows it good again in the next run."
    ),
    "limit": NOW_LIMIT,
    "disk": _NOW_DISK,
    "data_file": _NOW_DISK,
    "device_timeout": _NOW_DEVICE,
    "connection_lost": _NOW_DEVICE,
    "device_not_found": _NOW_DEVICE,
    "command_refused": _NOW_DEVICE,
}
"""What is to be done about a cause, by its code; NOW_LOOK about every other."""
OWN_TROUBLE = "An error of the window, not of the bench: {error}."
OWN_DID = "The run goes on in its own process; what this window shows may be incomplete."
OWN_NOW = "Close and open the window when no run is under way, and hand on the details."

CONFIGURATION_TITLES = ("key", "value", "unit")
OPEN_CONFIGURATION = "Open a configuration …"
OPEN_CONFIGURATION_TIP = "Reads another TOML file; one that is refused says why, and this one stays (Ctrl+Shift+O)."
OPEN_SPECIMEN = "Open a specimen file …"
OPEN_SPECIMEN_TIP = (
    "What was identified of the specimen, in place of what is assumed, as --specimen does (Ctrl+Shift+P)."
)
IDENTIFIED = "Specimen: {path}"
CONFIGURATION_KEPT = "{text}. What was open before stays."
MUST_BE = "It must be {allowed}."
FIND = "Look for devices"
FIND_TIP = "Asks NI's driver or server and every serial port, as `rockbench devices` does; takes some seconds (Ctrl+D)."
FIND_EMPTY = "Not looked for yet."
FIND_SIMULATED = "The simulated bench has no devices. Those of this computer can be looked for all the same."
FINDING = "Looking …"
FOUND = "As found just now."
FIND_FAILED = "The devices could not be looked for: {text}"
CHECK_LOOP = "Check the loop"
CHECK_LOOP_TIP = (
    "Listens at rest, then drives low-level sines with the frame locked to the table: polarity, scale and delay of "
    "every sensor, and the drive. As `rockbench check` (Ctrl+L)."
)
CHECK_LOOP_IDLE = "Not checked since the window was opened."
CHECK_LOOP_RUNNING = "Under way; its questions appear above."
CHECK_LOOP_ENDED = "{passed} passed, {failed} failed, {other} neither. {how}"
CHECK_IN = "Results are in {out}."
CHECK_CUT = "It did not come to its end."
CHECK_TABLE_TIP = "What to do about a line that has not passed is in its tooltip."
ASK_CHECK_TIP = "The frame is clamped and freed by hand: on this bench the check always asks."
CHECK_TITLES = ("verdict", "of", "what", "measured", "U (k = 2)", "allowed")

ADD, ADD_TIP = "Add to queue", "Puts the plan that was checked at the end of the queue (Ctrl+J)."
SAVE, SAVE_TIP = "Save in queue", "Puts the plan that was checked in place of test {number} of the queue (Ctrl+J)."
LEAVE, LEAVE_TIP = "Leave it as it was", "Ends the editing; the queue keeps the test as it was (Esc)."
TAKE_IN = "Take in"
QUEUE_TIP = "Tests run from the top. Enter opens one that has not begun in the form."
QUEUE_TITLES = ("", "state", "protocol", "what is asked for", "results in", "how it ended, or is to run")
STAGES = {
    "waiting": "○ waiting",
    "running": "● running",
    "done": "✓ done",
    "failed": "▲ failed",
    "skipped": "– skipped",
}
QUEUE_EMPTY = "The queue is empty: check a plan on the Protocol page, then add it."
QUEUE_STARTS, QUEUE_PAUSES = "Start the queue", "Pause after this test"
QUEUE_STARTS_TIP = "Runs what waits, from the top, each in a process of its own (Ctrl+Shift+Q)."
QUEUE_PAUSES_TIP = "The test that runs goes on to its end; nothing begins after it (Ctrl+Shift+Q)."
QUEUE_HOLDS = "the queue is running: pause it first"
QUEUE_IDLE, QUEUE_GOING, QUEUE_LAST = "{n} waiting.", "Running; {n} waiting.", "Pausing after this test; {n} waiting."
QUEUE_CHECKING = "The plan of test {number} is being checked; {n} waiting."
QUEUE_PAUSED = "▲ Paused: {why} {n} waiting."
QUEUE_STOPPED = "STOP was pressed; clear it on the Protocol page."
QUEUE_ENDED = "test {number} was {status}."
QUEUE_REFUSED = "the plan of test {number} is refused."
QUEUE_FILE = "Kept in {path}; `rockbench queue` runs the same file."
QUEUE_UNKEPT = "Not kept: it goes with this window."
QUEUE_OWNER = "the operator's window"
QUEUE_GONE = "The test that was edited has begun meanwhile, or was skipped or removed: it was not changed."
QUEUE_GONE_DID = "Nothing: the queue is as it was."
QUEUE_GONE_NOW = "What was edited is still on the Protocol page: check it and add it, or edit the test anew."
QUEUE_DID = "The queue is paused. The tests that wait are as they were in the file."
QUEUE_UNREAD_DID = "The file was left as it is. The queue of this window is empty, and kept nowhere."
QUEUE_UNREAD_NOW = (
    "Do what it says, or move the file, then open the window again; or name another one with --queue FILE."
)
QUEUE_NOW = "Free space or rights for the queue's file, or start the window with another one (--queue FILE)."
OPTIONS = {
    "realtime": "real time",
    "ask": "asks",
    "unattended": "unattended",
    "keep_going": "goes on without the window",
}
COPIES, COPIES_TIP = "times", "How many copies *Repeat* puts below the test."
QUEUE_ACTIONS = (
    ("up", "Up", "Ctrl+Up", "Moves the test one place up"),
    ("down", "Down", "Ctrl+Down", "Moves the test one place down"),
    ("repeat", "Repeat", "Ctrl+R", "Puts copies of the test below it, each with a folder of its own"),
    ("skip", "Skip", "Ctrl+T", "Leaves the test out, or takes it in again"),
    ("edit", "Edit …", "Ctrl+Shift+E", "Opens a test that has not begun in the form of the Protocol page"),
    ("remove", "Remove", "Del", "Takes the test off the list; its results stay where they are"),
)
"""Name, label, key and tooltip of what can be done with the test that is selected."""

NAMES = {
    "state": "state of the bench",
    "alpha": "running gain",
    "log": "event log",
    "queue": "queue",
    "picture": "picture of the specimen",
    "tour": "first minute",
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
"""What a screen reader calls the parts that have no label."""
