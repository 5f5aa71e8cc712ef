//! Requests to a bucket or server, each made until it succeeds or fails for good.

mod attempts;
mod parts;
mod requests;

pub(crate) use self::{
    parts::send,
    requests::{Bucket, Version},
};
