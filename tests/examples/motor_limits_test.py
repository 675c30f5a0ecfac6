"""The test print for motors: what it draws, and at which accelerations it drives, by unflex's own
plan of it."""
import subprocess
import sys

unflex, script = sys.argv[1], sys.argv[2] + "/motor_limits.sh"
ACCELS = [4000, 9000, 16000]


def written(firmware, *settings):
    return subprocess.run(
        [script, firmware, *settings], check=True, capture_output=True, text=True).stdout


for firmware in ("klipper", "marlin", "rrf"):
    text = written(firmware, "accels=" + ",".join(map(str, ACCELS)), "times=3", "center=100,90")
    lines = text.splitlines()
    drawn = [line for line in lines if line.startswith(("G1 X", "G1 Y")) and " E" in line]
    # Two halves of a tooth of two combs for each acceleration.
    assert len(drawn) == 4 * len(ACCELS), drawn
    filament = sum(float(word[1:]) for line in lines for word in line.split() if word[0] == "E")
    assert abs(filament - 4 * len(ACCELS) * 0.18) < 1e-6, filament
    # The second halves go on where the first ones end.
    ends = [float(line.split()[1][1:]) for line in drawn]
    first, second = ends[: len(ends) // 2], ends[len(ends) // 2 :]
    assert all(abs(b - a - 5) < 1e-6 for a, b in zip(first, second)), ends
    # No comb is where the head is driven to and fro.
    assert max(x - 100 for x in ends[1::2]) < -30 and max(y - 90 for y in ends[::2]) < -30, ends
    summary = subprocess.run(
        [unflex, "inspect", "-", "--set", "printer.firmware=" + firmware,
         "--set", "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45"],
        input="G28\n" + text, check=True, capture_output=True, text=True).stdout
    assert f" to {max(ACCELS)} mm/s² in force during moves" in summary, summary

for arguments in (["prusa"], ["klipper", "size=big"], ["klipper", "speeed=1"], []):
    result = subprocess.run([script, *arguments], capture_output=True, text=True)
    assert result.returncode == 2 and not result.stdout and "motor_limits.sh: " in result.stderr, arguments
print("the test print for motors is as it should be")
