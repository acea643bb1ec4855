/* The board's job in C, for bench_board: V4L2 buffers of a webcam go to a ZeroMQ socket, nothing more. `forward DEVICE WIDTH HEIGHT FPS ADDRESS`
 *
 * Each frame is a message of two parts: a header (sequence, stamp, size and send time) and the JPEG, which zmq_send copies out of the
 * ring. Like board-agent, it sends only the newest of several filled buffers and checks a JPEG's first and last bytes. It declares
 * libzmq's functions itself, so that a cross compiler needs the library alone, not the development package of its architecture. */
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

enum { ZMQ_PUSH = 8, ZMQ_SNDHWM = 23, ZMQ_DONTWAIT = 1, ZMQ_SNDMORE = 2, BUFFERS = 4 };
void *zmq_ctx_new(void);
void *zmq_socket(void *context, int type);
int zmq_setsockopt(void *socket, int option, const void *value, size_t size);
int zmq_bind(void *socket, const char *address);
int zmq_send(void *socket, const void *data, size_t size, int flags);

static int camera;

static void must(int result, const char *what) {
    if (result < 0) {
        perror(what);
        exit(3);
    }
}

static struct v4l2_buffer buffer_of(unsigned index) {
    return (struct v4l2_buffer){.index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
}

static int take(struct v4l2_buffer *buffer) { /* 1: taken, 0: no buffer is filled */
    *buffer = buffer_of(0);
    if (ioctl(camera, VIDIOC_DQBUF, buffer) == 0)
        return 1;
    must(errno == EAGAIN ? 0 : -1, "VIDIOC_DQBUF");
    return 0;
}

static int is_whole(const uint8_t *jpeg, size_t size) {
    while (size > 4 && jpeg[size - 1] == 0)
        size--;
    return size > 4 && jpeg[0] == 0xff && jpeg[1] == 0xd8 && jpeg[size - 2] == 0xff && jpeg[size - 1] == 0xd9;
}

int main(int count, char **words) {
    if (count != 6)
        return 2;
    unsigned width = atoi(words[2]), height = atoi(words[3]), fps = atoi(words[4]);
    void *socket = zmq_socket(zmq_ctx_new(), ZMQ_PUSH);
    int mark = 8;
    must(zmq_setsockopt(socket, ZMQ_SNDHWM, &mark, sizeof mark), "ZMQ_SNDHWM");
    must(zmq_bind(socket, words[5]), words[5]);

    must(camera = open(words[1], O_RDWR | O_NONBLOCK), words[1]);
    struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    format.fmt.pix = (struct v4l2_pix_format){.width = width, .height = height, .pixelformat = V4L2_PIX_FMT_MJPEG};
    must(ioctl(camera, VIDIOC_S_FMT, &format), "VIDIOC_S_FMT");
    struct v4l2_streamparm rate = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    rate.parm.capture.timeperframe = (struct v4l2_fract){1, fps};
    must(ioctl(camera, VIDIOC_S_PARM, &rate), "VIDIOC_S_PARM");
    struct v4l2_requestbuffers request = {.count = BUFFERS, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    must(ioctl(camera, VIDIOC_REQBUFS, &request), "VIDIOC_REQBUFS");
    const uint8_t *views[VIDEO_MAX_FRAME];
    for (unsigned i = 0; i < request.count; i++) {
        struct v4l2_buffer buffer = buffer_of(i);
        must(ioctl(camera, VIDIOC_QUERYBUF, &buffer), "VIDIOC_QUERYBUF");
        void *view = mmap(NULL, buffer.length, PROT_READ, MAP_SHARED, camera, buffer.m.offset);
        must(view == MAP_FAILED ? -1 : 0, "mmap");
        views[i] = view;
        must(ioctl(camera, VIDIOC_QBUF, &buffer), "VIDIOC_QBUF");
    }
    must(ioctl(camera, VIDIOC_STREAMON, &(int){V4L2_BUF_TYPE_VIDEO_CAPTURE}), "VIDIOC_STREAMON");

    for (;;) {
        struct pollfd waiting = {camera, POLLIN, 0};
        must(poll(&waiting, 1, -1), "poll");
        struct v4l2_buffer newest, next;
        if (!take(&newest))
            continue;
        while (take(&next)) {
            must(ioctl(camera, VIDIOC_QBUF, &newest), "VIDIOC_QBUF");
            newest = next;
        }
        if (is_whole(views[newest.index], newest.bytesused)) {
            struct timespec now;
            clock_gettime(CLOCK_MONOTONIC, &now);
            int64_t header[] = {newest.sequence, newest.timestamp.tv_sec, newest.timestamp.tv_usec, width, height, now.tv_sec, now.tv_nsec};
            if (zmq_send(socket, header, sizeof header, ZMQ_DONTWAIT | ZMQ_SNDMORE) >= 0)
                zmq_send(socket, views[newest.index], newest.bytesused, ZMQ_DONTWAIT);
        }
        must(ioctl(camera, VIDIOC_QBUF, &newest), "VIDIOC_QBUF");
    }
}
