#include "server/store/data_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace penumbra::store {

DataDirectory::DataDirectory(std::string path) : path_(std::move(path)) {
  make_directory(path_);
  // Links may lead here; inside there are none.
  path_ = std::filesystem::canonical(path_);
  lock_ = std::make_unique<File>(path_ + "/lock", O_RDWR | O_CREAT);
  if (::flock(lock_->descriptor(), LOCK_EX | LOCK_NB) == 0) return;
  if (errno == EWOULDBLOCK)
    throw std::runtime_error("the store " + path_ + " is in use by another server; --store names another directory");
  throw std::system_error(errno, std::generic_category(), "cannot lock " + path_);
}

bool DataDirectory::is_unclean() const {
  return ::faccessat(AT_FDCWD, unclean().c_str(), F_OK, AT_SYMLINK_NOFOLLOW) == 0;
}

void DataDirectory::mark_unclean() {
  write_file(unclean(), "");
  sync_directory(path_);
}

void DataDirectory::mark_clean() {
  remove_file(unclean());
  sync_directory(path_);
}

}  // namespace penumbra::store
