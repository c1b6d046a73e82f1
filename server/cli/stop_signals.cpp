#include "server/cli/stop_signals.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <system_error>

namespace penumbra::cli {

StopSignals::StopSignals(std::function<void()> on_stop, std::function<void()> on_hang_up) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_descriptor_ = signalfd(-1, &signals, SFD_CLOEXEC);
  end_descriptor_ = eventfd(0, EFD_CLOEXEC);
  if (signal_descriptor_ < 0 || end_descriptor_ < 0)
    throw std::system_error(errno, std::generic_category(), "cannot watch for signals");
  watcher_ = std::jthread([this, signals, on_stop = std::move(on_stop), on_hang_up = std::move(on_hang_up)] {
    std::array<pollfd, 2> watched{pollfd{signal_descriptor_, POLLIN, 0}, pollfd{end_descriptor_, POLLIN, 0}};
    signalfd_siginfo info;
    bool is_stop = false;
    while (!is_stop) {
      while (::poll(watched.data(), watched.size(), -1) < 0 && errno == EINTR) continue;
      if (watched[0].revents == 0 || ::read(signal_descriptor_, &info, sizeof info) < 0) return;
      is_stop = info.ssi_signo != SIGHUP || !on_hang_up;
      if (!is_stop) on_hang_up();
    }
    // Ctrl-C again is somebody in a hurry; a second SIGTERM comes from those who tell a group and then each of it.
    sigset_t impatient;
    sigemptyset(&impatient);
    sigaddset(&impatient, SIGINT);
    pthread_sigmask(SIG_UNBLOCK, &impatient, nullptr);
    on_stop();
    // Stays, for this is the thread that the second signal comes to.
    while (::poll(&watched[1], 1, -1) < 0 && errno == EINTR) continue;
  });
}

StopSignals::~StopSignals() {
  const std::uint64_t one = 1;
  if (::write(end_descriptor_, &one, sizeof one) > 0) watcher_.join();
  ::close(signal_descriptor_);
  ::close(end_descriptor_);
}

}  // namespace penumbra::cli
