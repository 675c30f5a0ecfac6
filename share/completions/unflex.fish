# Completion of unflex' command line for fish. `unflex COMMAND --help` has the same options.

# The words before the cursor that are commands: "printer init".
function __unflex_command
    set -l words (commandline -opc)
    set -l command
    for word in $words[2..]
        if test -z "$command"; and contains -- $word $__unflex_commands
            set command $word
        else if test "$command" = printer; and contains -- $word init line-test macros keys
            set command "printer $word"
        end
    end
    echo $command
end

# Whether the command is one of these.
function __unflex_in
    contains -- (__unflex_command) $argv
end

# Folders, and files whose names end in one of these; all files if there are no such files.
function __unflex_files
    set -l ends (string escape --style=regex -- $argv | string join '|')
    set -l all (__fish_complete_path (commandline -ct))
    string match --regex -- "^[^\t]*(?:$ends|/)(?:\t.*)?\$" $all; or printf '%s\n' $all
end

# Keys for --set, each with its equals sign; behind that the words that the key may be. The program
# tells of a key in lines that begin with a space.
function __unflex_settings
    set -l lines (unflex printer keys 2>/dev/null)
    set -l typed (string split --max 1 = -- (commandline -ct | string replace --regex -- '^--set=' ''))
    if test (count $typed) -lt 2
        string match --regex --groups-only -- '^(\S+)' $lines | string replace --regex -- '$' =
        return
    end
    set -l of_key (string match --regex -- '^'(string escape --style=regex -- $typed[1])'  .*' $lines)
    string match --all --regex -- '"[^"]+"|true|false' $of_key | string trim --chars '"' | string replace --regex -- '^' $typed[1]=
end

set -g __unflex_commands compensate batch verify inspect filament study identify tune hotend kinematics translate printer
set -l gcode '(__unflex_files .gcode .gco .g .bgcode .gcode.gz)'
set -l printer '(__unflex_files .toml .cfg .g .txt)'
set -l prints compensate verify inspect filament study translate

complete -c unflex -f
complete -c unflex -s h -l help -d 'Print the options and exit'
complete -c unflex -n '__unflex_in ""' -l version -d 'Print the version and exit'

complete -c unflex -n '__unflex_in ""' -a compensate -d 'Write G-code whose motion makes the nozzle draw the sliced path'
complete -c unflex -n '__unflex_in ""' -a batch -d 'Compensate all prints of a folder, those alone that have changed'
complete -c unflex -n '__unflex_in ""' -a verify -d 'Measure how far the nozzle strays when a compensated file is printed'
complete -c unflex -n '__unflex_in ""' -a inspect -d 'Show what is understood of a G-code file'
complete -c unflex -n '__unflex_in ""' -a filament -d 'Fit the E of a print to a filament that is not a full cylinder'
complete -c unflex -n '__unflex_in ""' -a study -d 'Measure all ways to move the base against each other'
complete -c unflex -n '__unflex_in ""' -a identify -d 'Find the resonances in records of accelerometers or a ringing tower'
complete -c unflex -n '__unflex_in ""' -a tune -d 'Find the resonances by printing towers and looking at their walls'
complete -c unflex -n '__unflex_in ""' -a hotend -d 'Find the gains that hold the temperature, from a log of a heating'
complete -c unflex -n '__unflex_in ""' -a kinematics -d 'Show what a print asks of the joints, or find how they move'
complete -c unflex -n '__unflex_in ""' -a translate -d 'Write a print as motion of the joints'
complete -c unflex -n '__unflex_in ""' -a printer -d 'Printer files'
complete -c unflex -n '__unflex_in printer' -a init -d 'Write a printer file from what already describes the printer'
complete -c unflex -n '__unflex_in printer' -a line-test -d 'Write G-code that shows how many lines per second the printer takes'
complete -c unflex -n '__unflex_in printer' -a keys -d 'List the keys that a printer file and --set take'
complete -c unflex -n '__unflex_in printer' -a macros -d 'Write macros by which a pause waits for the end of a compensated run'

complete -c unflex -n "__unflex_in $prints" -a $gcode
complete -c unflex -n '__unflex_in identify' -a '(__unflex_files .csv)'
complete -c unflex -n '__unflex_in tune kinematics' -a $gcode
complete -c unflex -n '__unflex_in hotend' -a '(__unflex_files .csv .log .txt)'

complete -c unflex -n '__unflex_in compensate filament translate' -s o -l output -x -a $gcode -d 'Where to write, - for stdout'
complete -c unflex -n '__unflex_in compensate filament translate' -l in-place -d 'Replace the input'
complete -c unflex -n '__unflex_in compensate' -l log -r -F -d 'Add what is said and the summary to a file'
complete -c unflex -n '__unflex_in batch' -a '(__fish_complete_directories (commandline -ct))'
complete -c unflex -n '__unflex_in batch' -s o -l output -x -a '(__fish_complete_directories (commandline -ct))' -d 'The folder to write to'
complete -c unflex -n '__unflex_in batch' -l report -x -a '(__fish_complete_directories (commandline -ct))' -d 'A page for each print, in this folder'
complete -c unflex -n '__unflex_in batch' -l summary -x -a '(__unflex_files .json .xml)' -d 'Write what became of each print'
complete -c unflex -n '__unflex_in batch' -l shard -x -a auto -d 'Work on one of several parts, I/N'
complete -c unflex -n '__unflex_in batch' -l watch -d 'Go on waiting for further prints'
complete -c unflex -n '__unflex_in verify' -l against -x -a $gcode -d 'The sliced G-code it was made from'
complete -c unflex -n '__unflex_in filament' -l filament-start-mm -x -d "Where on the filament's profile the print begins, mm"
complete -c unflex -n '__unflex_in compensate verify inspect filament translate' -l strict -d 'Take warnings for errors'
complete -c unflex -n '__unflex_in compensate batch verify' -l faster -d 'As fast as keeps the nozzle near the path; =µm'
complete -c unflex -n '__unflex_in compensate batch' -l timing -x -a 'scaled optimal' -d 'How --faster finds the timing'
complete -c unflex -n '__unflex_in compensate batch verify' -l max-deviation -x -d 'Exit with 3 if extruding moves stray further, mm'
complete -c unflex -n '__unflex_in compensate batch study' -l engine -x -a 'auto banded ipopt' -d 'What solves'
complete -c unflex -n '__unflex_in compensate batch' -l check-solver -d 'Have a sample solved by Ipopt as well'
complete -c unflex -n '__unflex_in compensate batch study tune' -s j -l jobs -x -d 'How many to compute at once'
complete -c unflex -n '__unflex_in study' -l machines -x -a '(__fish_complete_directories (commandline -ct))' -d 'Folder of resonance records of real machines'
complete -c unflex -n '__unflex_in study' -l map -d 'The best shaper for the whole bed, and unflex at each place'
complete -c unflex -n '__unflex_in study' -l faster -d 'The least print time within contour errors; =µm, as =10,20,50'
complete -c unflex -n '__unflex_in study' -l at-all-times -d 'Let no moment exceed the tolerance'
complete -c unflex -n '__unflex_in study' -l accel -x -d 'Compensate at these accelerations, as 2500,5000'
complete -c unflex -n '__unflex_in study' -l scale-m204 -d 'Scale accelerations of the print as well'
complete -c unflex -n '__unflex_in study' -l keep-rms -x -d 'Name the fastest within this RMS error'
complete -c unflex -n '__unflex_in study' -l case -x -a 'ref 1A 1B 2A 2B 3A 3B 4A 4B 5A 5B' -d 'Only this case of the corner'

complete -c unflex -n '__unflex_in identify' -l axis -x -a 'x y' -d 'The axis the records are of'
complete -c unflex -n '__unflex_in identify' -l freq-start -x -d 'Where the sweep began, Hz'
complete -c unflex -n '__unflex_in identify' -l freq-end -x -d 'Where the sweep ended, Hz'
complete -c unflex -n '__unflex_in identify' -l wave-spacing-mm -x -d 'Of a ringing tower: from wave to wave'
complete -c unflex -n '__unflex_in identify' -l speed-mm-s -x -d 'Of a ringing tower: speed of its walls'
complete -c unflex -n '__unflex_in identify' -l decay -x -d 'Of a ringing tower: height of a wave over that of the next'

complete -c unflex -n '__unflex_in identify' -l second -d 'Find what still rings behind compensated stops'
complete -c unflex -n '__unflex_in identify' -l make-test -x -a 'x y' -d 'Write G-code with such stops along an axis'
complete -c unflex -n '__unflex_in identify' -s o -l output -x -a $gcode -d 'Where --make-test writes, - for stdout'

complete -c unflex -n '__unflex_in tune' -l read -x -d 'Bands without waves, x=FIRST..LAST; repeatable'
complete -c unflex -n '__unflex_in tune' -s o -l output -x -a $gcode -d 'Where to write the next tower, - for stdout'
complete -c unflex -n '__unflex_in tune' -l like -x -a $gcode -d 'A sliced print, for its start code and end code'
complete -c unflex -n '__unflex_in tune' -l nozzle-temp -x -d 'Without --like: degrees Celsius'
complete -c unflex -n '__unflex_in tune' -l pressure -d 'The first tower tries pressure advances'
complete -c unflex -n '__unflex_in tune' -l bed-temp -x -d 'Without --like: degrees Celsius'
complete -c unflex -n '__unflex_in tune' -l accel -x -d 'Acceleration of the tower, mm/s²'
complete -c unflex -n '__unflex_in tune' -l report -x -a '(__unflex_files .html)' -d 'Write a page with pictures of the walls'

complete -c unflex -n '__unflex_in hotend' -l power -x -d 'What means full power in the log'
complete -c unflex -n '__unflex_in hotend' -l heater -x -a 'extruder extruder1 heater_bed' -d "The heater's section in printer.cfg"
complete -c unflex -n '__unflex_in hotend' -l ambient -x -d 'Temperature without power, degrees Celsius'
complete -c unflex -n '__unflex_in hotend' -l ku -x -d 'From a test: gain at which the temperature keeps swinging'
complete -c unflex -n '__unflex_in hotend' -l pu -x -d 'From a test: period of that swing, s'
complete -c unflex -n '__unflex_in hotend' -l rule -x -a 'simc simc-pi zn zn-pi cc tl' -d 'The rule that chooses the gains'
complete -c unflex -n '__unflex_in hotend' -l target -x -d 'Where the simulated step goes, degrees Celsius'
complete -c unflex -n '__unflex_in hotend' -l flow -x -d 'Filament that melts, mm³/s'
complete -c unflex -n '__unflex_in hotend' -l heater-watts -x -d 'What the heater gives at full power, W'

complete -c unflex -n '__unflex_in kinematics' -l fit -x -a '(__unflex_files .csv)' -d 'Measured places: qa,qb,qc,x,y,z'

complete -c unflex -n '__unflex_in "printer init"' -l from -x -a $printer -d 'What describes the printer'
complete -c unflex -n '__unflex_in "printer init"' -l record -x -a '(__unflex_files .csv)' -d 'A record of a resonance; repeatable'
complete -c unflex -n '__unflex_in "printer init"' -s o -l output -x -a '(__unflex_files .toml)' -d 'Where to write, - for stdout'

complete -c unflex -n '__unflex_in "printer line-test"' -s o -l output -x -a $gcode -d 'Where to write, - for stdout'
complete -c unflex -n '__unflex_in "printer macros"' -s o -l output -x -a '(__unflex_files .cfg)' -d 'Where to write, - for stdout'

complete -c unflex -n "__unflex_in $prints batch identify tune hotend kinematics 'printer line-test' 'printer macros'" -l printer -x -a $printer -d 'The printer'
complete -c unflex -n "__unflex_in $prints batch identify tune hotend kinematics 'printer init' 'printer line-test' 'printer macros'" -l set -x -a '(__unflex_settings)' -d 'Override a key of the printer file, KEY=VALUE'
complete -c unflex -n '__unflex_in inspect' -l all -d 'List the settings at their default, too'
complete -c unflex -n '__unflex_in inspect' -l report -x -a '(__unflex_files .json)' -d 'Write a report, - for stdout'
complete -c unflex -n '__unflex_in compensate verify study identify hotend' -l report -x -a '(__unflex_files .json .html)' -d 'Write a report, - for JSON to stdout'
complete -c unflex -n "__unflex_in $prints batch identify tune hotend kinematics 'printer init' 'printer line-test' 'printer macros'" -s q -l quiet -d 'No summary and no progress bar'
