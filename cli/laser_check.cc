#include "cli/laser_check.h"

#include "acquire/helios_dac.h"
#include "core/error.h"

#include <fmt/format.h>

namespace nacre::cli {
namespace {

using State = Finding::State;

}  // namespace

std::vector<Finding> CheckLasers() {
  std::vector<Finding> findings;
  try {
    for (const acquire::FoundDac& dac : acquire::FindHeliosDacs()) {
      const bool usable = dac.trouble.empty();
      findings.push_back(
          {"laser",
           usable ? dac.name : "Helios DAC",
           usable
               ? fmt::format("Helios DAC, firmware {}, bus {} device {}",
                             dac.firmware,
                             dac.bus,
                             dac.address)
               : fmt::format("bus {} device {}: {}", dac.bus, dac.address, dac.trouble),
           usable ? State::kGood : State::kProblem,
           usable ? ""
                  : "end other programs that use it; without permission: copy "
                    "share/nacre/70-nacre-helios.rules to /etc/udev/rules.d, join "
                    "plugdev, replug"});
    }
  } catch (const Error& e) {
    return {{"laser", "Helios DACs", "can't be looked for", State::kNote, e.what()}};
  }
  if (findings.empty()) {
    findings.push_back({"laser",
                        "Helios DACs",
                        "none",
                        State::kNote,
                        "plug one in to scan with a real laser; simulated rigs and "
                        "--dry-run need none"});
  }
  return findings;
}

}  // namespace nacre::cli
