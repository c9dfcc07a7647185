//! Services: one question, one answer, within a limit of time.

use std::time::Duration;

use hiroz::msg::{ZDeserializer, ZMessage, ZService};
use hiroz::service::{ServiceReply, ZServer};
use hiroz::{Builder, ServiceTypeInfo};
use thiserror::Error;

use crate::session::Session;

/// Why a question had no answer.
#[derive(Debug, Error)]
pub enum ServiceError {
    /// The service cannot be declared.
    #[error("service {name} cannot be declared: {cause}")]
    Declare {
        /// Its name.
        name: String,
        /// hiroz's words.
        cause: String,
    },
    /// Nobody answered in time.
    #[error("service {name} did not answer within {limit:?}: {cause}")]
    Unanswered {
        /// Its name.
        name: String,
        /// How long was waited.
        limit: Duration,
        /// hiroz's words.
        cause: String,
    },
}

/// The answering end.
pub struct Server<S: ZService> {
    inner: ZServer<S>,
}

impl<S> Server<S>
where
    S: ZService + ServiceTypeInfo,
    for<'a> <S::Request as ZMessage>::Serdes: ZDeserializer<Output = S::Request, Input<'a> = &'a [u8]>,
{
    pub(crate) fn declare(session: &Session, name: &str) -> Result<Self, ServiceError> {
        let inner = session
            .node()
            .create_service_impl::<S>(name, Some(S::service_type_info()))
            .build()
            .map_err(|e| ServiceError::Declare { name: name.to_owned(), cause: e.to_string() })?;
        Ok(Self { inner })
    }

    /// Waits for the next question that can be read; those that cannot are dropped. Cancel-safe.
    pub async fn next(&mut self) -> (S::Request, Answer<S>) {
        loop {
            match self.inner.async_take_request().await {
                Ok(request) => {
                    let (question, reply) = request.into_parts();
                    return (question, Answer { reply });
                }
                Err(cause) => {
                    tracing::warn!(%cause, "a malformed request was dropped");
                    // A closed session fails at once and for ever: do not spin on it.
                    tokio::time::sleep(Duration::from_millis(20)).await;
                }
            }
        }
    }
}

/// The right to answer one question.
pub struct Answer<S: ZService> {
    reply: ServiceReply<S>,
}

impl<S: ZService> Answer<S> {
    /// Sends the answer. One that nobody waits for any more is no loss.
    pub async fn give(self, answer: &S::Response) {
        if let Err(cause) = self.reply.reply(answer).await {
            tracing::debug!(%cause, "an answer was not sent");
        }
    }
}

/// Asks once.
///
/// # Errors
/// [`ServiceError`] when nobody answers within `limit`.
pub async fn call<S>(
    session: &Session,
    name: &str,
    question: &S::Request,
    limit: Duration,
) -> Result<S::Response, ServiceError>
where
    S: ZService + ServiceTypeInfo,
    for<'a> <S::Response as ZMessage>::Serdes: ZDeserializer<Output = S::Response, Input<'a> = &'a [u8]>,
{
    let client = session
        .node()
        .create_client_impl::<S>(name, Some(S::service_type_info()))
        .build()
        .map_err(|e| ServiceError::Declare { name: name.to_owned(), cause: e.to_string() })?;
    client.call_with_timeout(question, limit).await.map_err(|e| ServiceError::Unanswered {
        name: name.to_owned(),
        limit,
        cause: e.to_string(),
    })
}
