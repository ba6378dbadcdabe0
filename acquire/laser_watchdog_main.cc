// nacre-laser-watchdog BUS ADDRESS PARENT: started by LaserWatchdog, by nobody else.

#include "acquire/laser_watchdog.h"
#include "core/error.h"

#include <cstdlib>
#include <iostream>

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "nacre-laser-watchdog is started by nacre alone\n";
    return static_cast<int>(nacre::ExitCode::kUsage);
  }
  try {
    return nacre::acquire::RunLaserWatchdog(
        std::atoi(argv[1]), std::atoi(argv[2]), std::atoi(argv[3]));
  } catch (const nacre::Error& e) {
    std::cerr << "nacre-laser-watchdog: " << e.what() << '\n';
    return static_cast<int>(e.code());
  }
}
