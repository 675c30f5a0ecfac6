// Sources: Klipper klippy/extras/gcode_macro.py (macros, variables, rename_existing),
// pause_resume.py (what PAUSE does, also for the web interface), virtual_sdcard.py (is_active,
// do_pause), filament_switch_sensor.py (what a runout does).
#include "klipper_macros.hpp"

#include <fmt/core.h>

#include <string_view>

#include "unflex/app/run_config.hpp"

namespace unflex::app {
namespace {

constexpr std::string_view kCheckpoint = R"(
# Include this file after all others that have macros, at the end of printer.cfg but before what
# SAVE_CONFIG has written there. Prints have to be compensated with emit.checkpoints = true.
#
# PAUSE and CANCEL_PRINT that come inside a compensated run are kept until the run's end. RESUME
# before it calls them off. With NOW=1 they act at once, and the motors stop within a line.
# Macros of these names that the printer has already, as those of Mainsail and Fluidd, are called
# when the time has come.

[pause_resume]

# Called where a run begins (RUN=1), where it has ended, and where the input shaper has changed. The
# other words put the printer's own shaper back while it is off. Nothing here moves or stops the
# machine unless a pause waits.
[gcode_macro UNFLEX_CHECKPOINT]
description: Where a compensated print may pause
# Sensors at which a print pauses when filament has run out, as
# ['filament_switch_sensor runout']. Give these pause_on_runout: False and no runout_gcode.
variable_sensors: []
variable_state: {}
variable_file_size: 0
variable_wanted: ''
variable_words: {}
variable_limits: {}
gcode:
  {% set card = printer.virtual_sdcard %}
  {% set size = card.file_size if card else 0 %}
  {% if params != state %}
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=state VALUE="{params}"
  {% endif %}
  {% if size != file_size %}
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=file_size VALUE={size}
  {% endif %}
  {% set empty = namespace(sensor='') %}
  {% for name in sensors %}
    {% set sensor = printer[name] %}
    {% if sensor.enabled and not sensor.filament_detected %}
      {% set empty.sensor = name %}
    {% endif %}
  {% endfor %}
  {% if params.RUN %}
    {% if wanted %}
      # Of a print that ended inside a run.
      SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=wanted VALUE="''"
    {% endif %}
  {% elif wanted %}
    {wanted} NOW=1{% for word, value in words.items() %} {word}="{value}"{% endfor %}

  {% elif empty.sensor %}
    {action_respond_info("unflex: no filament at %s" % empty.sensor)}
    PAUSE NOW=1
  {% endif %}

# The names are spelt like this because a second section [gcode_macro PAUSE] would take the place of
# the printer's own. Klipper makes a command of it without regard to case.
)";

// @ stands for the command, ~ for its section's name.
constexpr std::string_view kDeferred = R"([gcode_macro ~]
description: @, which a compensated print obeys at the end of its run
rename_existing: UNFLEX_BASE_@
gcode:
  {% set own = printer['gcode_macro UNFLEX_CHECKPOINT'] %}
  {% set card = printer.virtual_sdcard %}
  {% set words = dict(params) %}
  {% set now = words.pop('NOW', '0') != '0' %}
  {% set in_run = own.state.RUN and card and card.is_active and card.file_size == own.file_size %}
  {% if in_run and not now %}
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=words VALUE="{words}"
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=wanted VALUE="'@'"
    {action_respond_info("unflex: @ comes at the end of the run, with NOW=1 at once")}
  {% else %}
    _UNFLEX_LEAVE
    UNFLEX_BASE_@{% for word, value in words.items() %} {word}="{value}"{% endfor %}

)";

constexpr std::string_view kAfterPause = R"(  {% endif %}

)";

constexpr std::string_view kAfterCancel =
    R"(    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=state VALUE="{dict()}"
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=limits VALUE="{dict()}"
  {% endif %}

)";

constexpr std::string_view kRest = R"([gcode_macro rESUME]
description: Resume the print, or call off a pause that has not come yet
rename_existing: UNFLEX_BASE_RESUME
gcode:
  {% set own = printer['gcode_macro UNFLEX_CHECKPOINT'] %}
  {% if own.wanted and not printer.pause_resume.is_paused %}
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=wanted VALUE="''"
    {action_respond_info("unflex: %s is called off" % own.wanted)}
  {% else %}
    UNFLEX_BASE_RESUME {rawparams}
    _UNFLEX_RETURN
  {% endif %}

# At rest, with the printer's own limits and shaper, for what parks the head. A print that goes on
# inside a run keeps the printer's own acceleration and corners until the run's end, since its lines
# would have the motors leap from standstill.
[gcode_macro _UNFLEX_LEAVE]
gcode:
  {% set own = printer['gcode_macro UNFLEX_CHECKPOINT'] %}
  {% set now = printer.toolhead %}
  {% set back = printer.configfile.settings.printer %}
  SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=wanted VALUE="''"
  {% if not printer.pause_resume.is_paused %}
    {% set limits = {'VELOCITY': now.max_velocity} %}
    {% if not own.state.RUN %}
      {% set _ = limits.update({'ACCEL': now.max_accel,
                                'SQUARE_CORNER_VELOCITY': now.square_corner_velocity}) %}
    {% endif %}
    {% set ratio = now.minimum_cruise_ratio is defined %}
    {% if ratio %}{% set _ = limits.update({'MINIMUM_CRUISE_RATIO': now.minimum_cruise_ratio}) %}{% endif %}
    M400
    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=limits VALUE="{limits}"
    SET_VELOCITY_LIMIT VELOCITY={back.max_velocity} ACCEL={back.max_accel} SQUARE_CORNER_VELOCITY={back.square_corner_velocity}{% if ratio %} MINIMUM_CRUISE_RATIO={back.minimum_cruise_ratio}{% endif %}

    _UNFLEX_SHAPER
  {% endif %}

# As the rest of the file expects limits and shaper.
[gcode_macro _UNFLEX_RETURN]
gcode:
  {% set own = printer['gcode_macro UNFLEX_CHECKPOINT'] %}
  {% if own.limits and not printer.pause_resume.is_paused %}
    _UNFLEX_SHAPER OFF=1
    SET_VELOCITY_LIMIT{% for word, value in own.limits.items() %} {word}={value}{% endfor %}

    SET_GCODE_VARIABLE MACRO=UNFLEX_CHECKPOINT VARIABLE=limits VALUE="{dict()}"
  {% endif %}

[gcode_macro _UNFLEX_SHAPER]
gcode:
  {% set own = printer['gcode_macro UNFLEX_CHECKPOINT'] %}
  {% set card = printer.virtual_sdcard %}
  {% set words = dict(own.state) %}
  {% set _ = words.pop('RUN', '') %}
  {% if words and own.file_size == (card.file_size if card else 0) %}
    SET_INPUT_SHAPER{% for word, value in words.items() %} {word}={0 if params.OFF else value}{% endfor %}

  {% endif %}
)";

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string deferred(std::string_view section, std::string_view command) {
  return replaced(replaced(std::string(kDeferred), "~", section), "@", command);
}

}  // namespace

std::string klipper_macros() {
  return fmt::format("# Written by unflex {}: see docs/pausing.md.\n", version())
      .append(kCheckpoint.substr(1))
      .append(deferred("pAUSE", "PAUSE"))
      .append(kAfterPause)
      .append(deferred("cANCEL_PRINT", "CANCEL_PRINT"))
      .append(kAfterCancel)
      .append(kRest);
}

}  // namespace unflex::app
