"""Every text of the window, in one place."""

from bench.events import State

TITLE = "rocking-bench"
PAGES = ("Setup", "Protocol", "Run", "Results")

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

STOP = "STOP\nF12"
STOP_AGAIN = "HALT\nF12"
STOP_TIP = "Ramps the output out fast and ends the run (F12, from everywhere). Pressed again: cuts the enable line."
LATCHED = "STOP was pressed: clear it first"
CLEAR = "Clear STOP"
CLEAR_TIP = "Allows a new run. The run that was stopped is not resumed."

ELAPSED, REMAINING, STEP, INPUTS = "elapsed", "remaining", "step", "safety inputs"
NO_INPUTS = "none are wired"
INPUT_GOOD, INPUT_OPEN = "good", "OPEN"

CHECK = "Check the plan"
CHECK_TIP = "Computes the whole run beforehand: prediction, margin to every limit, time and disk (Ctrl+K)."
CHECKING = "The plan is being computed …"
START = "Start"
START_TIP = "Starts the run (Ctrl+Return)."
START_BUSY = "a run is under way"
START_UNCHECKED = "check the plan first"
START_BAD = "a value is refused: see the form"
START_REFUSED = "the plan is refused"
REALTIME, REALTIME_TIP = "Real time", "Lets the simulated bench run at the pace of the clock, not as fast as it can."
ASK, ASK_TIP = "Ask me", "Ask for the hand work even where the bench does it by itself."
GO_ON = "Go on without this window"
GO_ON_TIP = "A run whose window is closed, frozen or killed ramps out; with this it goes on to its end."
FOLDER, OPERATOR = "Results in", "Operator"
FOLDER_TIP = "Folder for the results; made if missing. Results that are there already are never overwritten."
OPERATOR_TIP = "Who runs it; kept in the data file."
DEFAULT_TIP = "Left empty: {default}."
MARGINS = ("quantity", "unit", "demand", "at 95 %", "limit", "margin [%]", "where")
TIME_AND_DISK = "Expected duration {duration}. Disk: {needed:.0f} MB may be needed, {free:.0f} MB are free."
TIGHTEST = "Tightest: {name}, limited by {owner}."
MAY_RUN, MAY_NOT = "The plan is within every limit.", "Refused: {why}"
NO_MARGINS = "This protocol predicts no margins."

DONE, DECLINE = "Done, go on", "End the run"
PROMPT = "The bench waits for you"
PROMPT_WHY = "The output is at zero and stays there until you answer. The sensors are checked at rest before it moves."

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
SECONDS = "seconds before the newest sample"
ALPHA, PREDICTED = "gain α₂", "predicted"
OMEGA_AXIS, GAIN_AXIS = "circular frequency ω [rad/s]", "gain α₂ [1]"
NO_GAIN = "no gain yet"
LOST = "{events} events and {traces} blocks of traces were not shown: the file has them all."
DATA_AGE = "newest sample {age:.1f} s old"
FRAME = "Frame, block and spring; motion drawn {factor:g} times as large"

OPEN, OPEN_TIP = "Open a file …", "Opens the campaign.h5 of a run (Ctrl+O)."
OPEN_ARMED = "not while the bench is armed: a dialog would cover it"
RESULTS_EMPTY = "No file is open. The results of a run appear here when it is over."
ENDED = "The run was {status}: {reason}. Results are in {out}."
REFUSED = "Nothing was started. {text}"
FAILED_WORD = "FAILED"
FAILED = (
    "The session failed: {text}. Its file holds what was measured until then. "
    "Look at the bench: if the table moves, press the emergency stop."
)

WELCOME = (
    "First minute: this is the virtual bench, nothing real moves. The form holds one harmonic point. "
    "1. Check the plan.  2. Start.  3. Watch the gain come to its prediction on the Run page.  "
    "4. See the file under Results."
)
WELCOME_CLOSE = "Hide"
CONFIGURATION = "Configuration"
VIRTUAL = "the simulated bench with the paper's specimen (no configuration file was given)"

OWN_ERROR = "an error of the window, not of the bench: {error}. The run goes on; the terminal has the details."
