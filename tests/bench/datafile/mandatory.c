/* Mandatory locks for a test: a write to a *.h5 file fails with errno 13 while a reader has it locked, as on
   Windows. Loaded with LD_PRELOAD. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int locked(int handle)
{
    char link[64], path[4096], line[256], place[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    ssize_t length = readlink(link, path, sizeof path - 1);
    struct stat file;
    if (length < 3 || strncmp(path + length - 3, ".h5", 3) != 0 || fstat(handle, &file) != 0)
        return 0;
    snprintf(place, sizeof place, ":%lu ", (unsigned long)file.st_ino);
    FILE *locks = fopen("/proc/locks", "r");
    int held = 0;
    /* the writer's own lock is exclusive, and elsewhere in the file on Windows */
    while (locks && !held && fgets(line, sizeof line, locks))
        held = strstr(line, "FLOCK") && strstr(line, "READ") && strstr(line, place);
    if (locks)
        fclose(locks);
    return held;
}

#define GUARDED(name, type, parameters, arguments)                       \
    type name parameters                                                 \
    {                                                                    \
        static type(*real) parameters;                                   \
        if (!real)                                                       \
            *(void **)&real = dlsym(RTLD_NEXT, #name);                   \
        if (locked(handle)) {                                            \
            errno = EACCES;                                              \
            return -1;                                                   \
        }                                                                \
        return real arguments;                                           \
    }

GUARDED(pwrite, ssize_t, (int handle, const void *data, size_t size, off_t at), (handle, data, size, at))
GUARDED(pwrite64, ssize_t, (int handle, const void *data, size_t size, off64_t at), (handle, data, size, at))
GUARDED(write, ssize_t, (int handle, const void *data, size_t size), (handle, data, size))
