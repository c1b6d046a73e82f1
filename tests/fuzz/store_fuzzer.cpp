// A data directory whose bytes somebody or something has changed: the store opens and answers, or refuses with an
// exception; it never crashes. An input is a list of changes to the files of a small, real store.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "server/store/sqlite_store.h"

using namespace penumbra;
namespace fs = std::filesystem;

namespace {

/// In memory where the system has such a place: the store writes to the disk and waits.
fs::path make_folder() {
  std::string name = fs::is_directory("/dev/shm") ? "/dev/shm/penumbra-fuzz-XXXXXX" : "/tmp/penumbra-fuzz-XXXXXX";
  if (::mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

struct Files {
  fs::path folder = make_folder();
  std::vector<std::pair<fs::path, std::string>> contents;  // of a store that was not stopped in order

  Files() {
    const fs::path original = folder / "original";
    store::SqliteStore store({original, "engine", 0, [](const char*) {}});
    for (int i = 0; i < 8; ++i) {
      store::JobRecord job;
      job.id = "01JDF3Z4N6Q8R0S2T4V6X8Y0Z" + std::to_string(i);
      job.owner = i % 2 == 0 ? "alice" : "bob";
      job.spec_hash = "hash" + std::to_string(i);
      job.created_at = std::chrono::system_clock::now();
      store.create(job, "{\"scene\": {}}", store::IdempotencyKey{"key" + std::to_string(i), "hash", job.owner});
      if (i > 2) store.start(job.id, job.created_at);
      if (i < 5) continue;
      store::Ending ending;
      ending.finished_at = job.created_at;
      ending.stats = render::Stats{};
      ending.image = store::Image{std::make_shared<const std::string>("bytes" + std::to_string(i)), "image/png",
                                  std::string(64, static_cast<char>('0' + i)), nullptr};
      store.finish(job.id, std::move(ending));
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(original)) {
      if (!entry.is_regular_file() || entry.path().filename() == "penumbra.db-shm") continue;
      std::ifstream file(entry.path(), std::ios::binary);
      contents.emplace_back(fs::relative(entry.path(), original),
                            std::string(std::istreambuf_iterator<char>(file), {}));
    }
  }
  ~Files() { fs::remove_all(folder); }
};

void use(store::SqliteStore& store) {
  const store::Page page = store.list({}, 100, {});
  for (const store::JobRecord& job : page.jobs) {
    store.find(job.id);
    store.spec(job.id);
    store.image(job.id);
    store.start(job.id, job.created_at);
  }
  store.list({api::JobState::failed, "alice"}, 1, "01JDF3Z4N6Q8R0S2T4V6X8Y0Z5");
  store.unfinished();
  store.newest_id();
  store.find_key({"key1", "hash", "bob"});
  store::Retention nothing;
  nothing.max_jobs = 1;
  nothing.max_image_bytes = 1;
  nothing.max_spec_bytes = 1;
  nothing.image_age = nothing.job_age = std::chrono::seconds(0);
  store.expire(nothing, std::chrono::system_clock::now());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Files files;
  auto contents = files.contents;
  // Each change: which file, how, where, and with what.
  for (; size >= 5; data += 5, size -= 5) {
    std::string& bytes = contents[data[0] % contents.size()].second;
    const std::size_t place = (std::size_t{data[2]} << 8 | data[3]) << (data[1] >> 6);
    if (bytes.empty()) continue;
    if (data[1] % 8 == 0)
      bytes.resize(place % bytes.size());
    else if (data[1] % 8 == 1)
      bytes.append(place, static_cast<char>(data[4]));
    else
      bytes[place % bytes.size()] = static_cast<char>(data[4]);
  }
  const fs::path folder = files.folder / "changed";
  fs::remove_all(folder);
  for (const auto& [name, bytes] : contents) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name, std::ios::binary) << bytes;
  }
  try {
    store::SqliteStore store({folder, "engine", 0, [](const char*) {}});
    use(store);
  } catch (const std::exception&) {
    // A refusal is an answer.
  }
  return 0;
}
