// A file system without locks, such as NFS without its lock daemon: flock fails as it does there.
#include <errno.h>
#include <sys/file.h>

int flock(int descriptor, int operation) {
    (void)descriptor;
    (void)operation;
    errno = ENOLCK;
    return -1;
}
