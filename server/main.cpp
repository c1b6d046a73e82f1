#include <fcntl.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/cli/program.h"

namespace {

/// Opens what is closed of the standard streams, on nothing: the next file to be opened would take its place, and get
/// what is meant for people.
bool fill_standard_streams() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= 2) descriptor = ::open("/dev/null", O_RDWR);
  if (descriptor > 2) ::close(descriptor);
  return descriptor > 2;
}

}  // namespace

// Only a mistake in the flags' definitions throws. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  return fill_standard_streams() ? penumbra::cli::run(argc, argv) : penumbra::cli::status_failed;
}
