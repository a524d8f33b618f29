#include "tools/products/virtual_room/snap_sound.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>

namespace room {

bool SnapPlayer::start() {
  std::signal(SIGPIPE, SIG_IGN);  // lets the room go on when the player program ends
  const char* players[][2] = {
      {"command -v pacat >/dev/null",
       "exec pacat --raw --format=s16le --rate=8000 --channels=1 --latency-msec=60 2>/dev/null"},
      {"command -v aplay >/dev/null",
       "exec aplay -q -t raw -f S16_LE -r 8000 --buffer-time=60000 2>/dev/null"}};
  for (const auto& [has, play] : players) {
    if (std::system(has) != 0) continue;
    pipe_.reset(popen(play, "we"));
    if (!pipe_) return false;
    fcntl(fileno(pipe_.get()), F_SETFL, O_NONBLOCK);
    fcntl(fileno(pipe_.get()), F_SETPIPE_SZ, 4096);  // holds a quarter of a second of sound
    return true;
  }
  return false;
}

bool SnapPlayer::send() {
  const bool ended = plays() && !samples_.empty() &&
                     write(fileno(pipe_.get()), samples_.data(), samples_.size() * sizeof samples_[0]) < 0 &&
                     errno == EPIPE;
  samples_.clear();
  if (ended) stop();
  return !ended;
}

void SnapPlayer::Close::operator()(std::FILE* pipe) const { pclose(pipe); }

}  // namespace room
